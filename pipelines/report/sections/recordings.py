"""The quality of each recording: from its metadata, and from its time stamps."""

from dataclasses import dataclass
from typing import Any

import numpy as np

from pipelines.contracts import MOTION, RECORDING
from pipelines.report.sections.section import Content
from pipelines.report.session import Artifact, Session

ROUNDING = 1e-4
"""Unevenness that rounding explains, in sample periods."""


@dataclass(frozen=True)
class Run:
    """One recording, or a motion if there are no recordings."""

    file: str
    run: str
    purpose: str
    about: str
    """Rig, subject and session, from the file."""
    samples: int
    duration_s: float
    rate_hz: float
    """From the file."""
    measured_rate_hz: float
    """Inverse of the median time step."""
    jitter_ms: float
    """Half the width of the interval that contains 98 % of the time steps."""
    gaps: int
    missing: int
    abort: str
    recovered: bool
    latency: dict[str, float] | None
    """Response times of the devices: ``median_ms``, ``p99_ms``, ``longest_ms``; None if absent."""
    clocks: tuple[str, ...]
    imported: str
    filter: str
    """Filter and reason of its cut-off; empty if the run was not filtered."""

    @property
    def rate_is_off(self) -> bool:
        """Whether the time stamps contradict the stated rate."""
        # Relative difference of sampling rates that counts as equal.
        rate_tolerance = 0.005
        return abs(self.measured_rate_hz / self.rate_hz - 1.0) > rate_tolerance

    @property
    def is_even(self) -> bool:
        """Whether all time steps are equal up to rounding."""
        return self.jitter_ms * 1e-3 * self.rate_hz < ROUNDING

    @property
    def notes(self) -> list[str]:
        """Notes on import, clocks and filter."""
        notes = {
            "imported from": self.imported,
            "clocks": "; ".join(self.clocks),
            "filtered by": self.filter,
        }
        return [f"{words} {note}" for words, note in notes.items() if note]


def context(content: Content) -> dict[str, Any]:
    """Return the values of the template's table of recordings."""
    return {"recordings": _runs(content.session)}


def _runs(session: Session) -> list[Run]:
    """Return every run of a session, in the order of their files."""
    recordings = session.of_kind("recording")
    # A motion has the file name of its recording.
    filters = {one.path.name: one for one in session.of_kind("motion")}
    chosen = recordings or list(filters.values())
    return [_run(session, one, filters.get(one.path.name)) for one in chosen]


def _run(session: Session, artifact: Artifact, motion: Artifact | None) -> Run:
    about, time = artifact.metadata, _time(artifact)
    step = np.diff(time)
    usual = float(np.median(step)) if len(step) else float("nan")
    # Gaps are counted on their own, and are no jitter.
    near = step[step < 1.5 * usual] if len(step) else step
    # Half of 98 %, so that a single late row does not count.
    jitter = float(np.subtract(*np.percentile(near, [99, 1]))) / 2 if len(near) else 0.0
    gaps = about.get("gaps") or []
    return Run(
        file=session.shown(artifact.path),
        run=about["run"],
        purpose=about["purpose"],
        about=origin(artifact),
        samples=len(time),
        duration_s=float(time[-1] - time[0]),
        rate_hz=float(about["sample_rate_hz"]),
        measured_rate_hz=1.0 / usual if usual > 0 else float("nan"),
        jitter_ms=1e3 * jitter,
        gaps=len(gaps),
        missing=sum(count for _, count in gaps),
        abort=about.get("abort") or "",
        recovered=bool(about.get("recovered")),
        latency=about.get("latency"),
        clocks=tuple(_clock(joint, clock) for joint, clock in (about.get("clocks") or {}).items()),
        imported=_imported(about.get("imported")),
        filter=_filter(motion.metadata.get("filter")) if motion else "",
    )


def origin(artifact: Artifact) -> str:
    """Return rig, subject and session of a recording; empty if its metadata have none."""
    keys = ("rig", "subject", "session")
    return ", ".join(str(artifact.metadata[key]) for key in keys if artifact.metadata.get(key))


def _time(artifact: Artifact) -> np.ndarray:
    contract = RECORDING if artifact.kind == "recording" else MOTION
    pieces = contract.scan(artifact.path).pieces(["time_s"])
    return np.concatenate([piece.column("time_s").to_numpy() for piece in pieces])


def _clock(joint: str, clock: dict[str, Any]) -> str:
    offset_ms, rate_ppm = 1e3 * clock["offset_s"], clock["rate_ppm"]
    corrected = "corrected" if clock["corrected"] else "not corrected"
    return f"{joint} {offset_ms:+.3g} ms and {rate_ppm:+.3g} ppm, {corrected}"


def _imported(about: Any) -> str:
    if not isinstance(about, dict):
        return ""
    stated = [str(about[key]) for key in ("source", "format") if about.get(key)]
    return ", ".join(stated) or "imported"


def _filter(about: Any) -> str:
    if not isinstance(about, dict):
        return ""
    text = f"{about.get('kind', 'filter')}, {about.get('cutoff_hz', 0):.3g} Hz".replace("_", " ")
    return f"{text}: {about['why']}" if about.get("why") else text
