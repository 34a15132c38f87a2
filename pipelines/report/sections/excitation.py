"""The excitation: its condition, expected standard errors, and margins to its bounds."""

from dataclasses import dataclass
from math import pi
from typing import Any

from pipelines.report.sections.section import Content
from pipelines.report.sections.symbols import unit
from pipelines.report.session import Artifact, Session
from pipelines.wording.numbers import digits

NUMBERS = {
    "condition": "condition number",
    "scaled_condition": "condition number of its columns scaled to one length",
    "log_det": "log determinant of the regressor's Gram matrix",
}


@dataclass(frozen=True)
class Excitation:
    """A ``trajectory/1`` file as the page shows it."""

    file: str
    about: str
    margins: tuple[dict[str, Any], ...]
    """Each with joint, quantity, unit, low, high, lowest, highest and margin."""
    errors: tuple[tuple[str, float | None, str], ...]
    """Name, expected standard error and unit of each parameter."""


def context(content: Content) -> dict[str, Any]:
    """Return the values of the template's part on the excitation."""
    return {"excitations": _excitations(content.session)}


def _excitations(session: Session) -> list[Excitation]:
    """Return every excitation of a session."""
    return [_excitation(session, one) for one in session.of_kind("trajectory")]


def _excitation(session: Session, artifact: Artifact) -> Excitation:
    about = artifact.metadata
    known = {key: words for key, words in NUMBERS.items() if about.get(key) is not None}
    facts = [f"{words} {digits(about[key])}" for key, words in known.items()]
    # Only trajectories that are Fourier series have coefficients.
    if about.get("a") and about.get("omega_rad_s"):
        base_hz = about["omega_rad_s"] / (2 * pi)
        facts.insert(0, f"{len(about['a'][0])} harmonics of {digits(base_hz)} Hz")
    stated = (about.get("standard_errors") or {}).items()
    errors = tuple((name, error, unit(session, name)) for name, error in stated)
    margins = tuple(about.get("margins") or ())
    return Excitation(session.shown(artifact.path), ", ".join(facts), margins, errors)
