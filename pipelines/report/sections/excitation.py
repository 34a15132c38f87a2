"""The excitation: its condition, expected standard errors, and margins to its bounds."""

from math import pi
from typing import Any

from pipelines.report.sections.symbols import unit
from pipelines.report.session import Artifact, Session
from pipelines.wording.numbers import digits


def excitation(session: Session, artifact: Artifact) -> dict[str, Any]:
    """Return the values of the template's card of a ``trajectory/1`` file."""
    about = artifact.metadata
    numbers = {
        "condition": "condition number",
        "scaled_condition": "condition number of its columns scaled to one length",
        "log_det": "log determinant of the regressor's Gram matrix",
    }
    known = {key: words for key, words in numbers.items() if about.get(key) is not None}
    facts = [f"{words} {digits(about[key])}" for key, words in known.items()]
    # Only trajectories that are Fourier series have coefficients.
    if about.get("a") and about.get("omega_rad_s"):
        base_hz = about["omega_rad_s"] / (2 * pi)
        facts.insert(0, f"{len(about['a'][0])} harmonics of {digits(base_hz)} Hz")
    stated = (about.get("standard_errors") or {}).items()
    if empty := about.get("detection_lines"):
        odd = sum(line % 2 for line in empty)
        facts.insert(1, f"{odd} odd and {len(empty) - odd} even detection lines left empty")
    return {
        "file": session.shown(artifact.path),
        "about": ", ".join(facts),
        "margins": about.get("margins") or [],
        "errors": [(name, error, unit(session, name)) for name, error in stated],
    }
