"""How well each run was recorded: what its file says of itself, and what its times say."""

from dataclasses import dataclass
from typing import Any

import numpy as np

from pipelines.contracts import MOTION, RECORDING
from pipelines.report.session import Artifact, Session

RATE_TOLERANCE, ROUNDING = 0.005, 1e-4


@dataclass(frozen=True)
class Run:
    """One recording, or, where only that is there, a motion."""

    file: str
    run: str
    purpose: str
    about: str
    """Rig, subject and session, as the file names them."""
    samples: int
    duration_s: float
    rate_hz: float
    """As the file says it."""
    measured_rate_hz: float
    """One over the middle of the steps of time."""
    jitter_ms: float
    """Half the width within which 98 % of the steps of time lie."""
    gaps: int
    missing: int
    abort: str
    recovered: bool
    latency: dict[str, float] | None
    """How long answers took: ``median_ms``, ``p99_ms``, ``longest_ms``; None where the file does
    not say."""
    clocks: tuple[str, ...]
    imported: str
    filter: str
    """The filter and why its cut-off, where the run was filtered."""

    @property
    def rate_is_off(self) -> bool:
        """Whether the times tell another rate than the file says."""
        return abs(self.measured_rate_hz / self.rate_hz - 1.0) > RATE_TOLERANCE

    @property
    def is_even(self) -> bool:
        """Whether every step of time is the same, but for how numbers are rounded."""
        return self.jitter_ms * 1e-3 * self.rate_hz < ROUNDING

    @property
    def notes(self) -> list[str]:
        """Return what else is to be said of it."""
        texts = {
            "imported from": self.imported,
            "clocks": "; ".join(self.clocks),
            "filtered by": self.filter,
        }
        return [f"{words} {what}" for words, what in texts.items() if what]


def runs(session: Session) -> list[Run]:
    """Return every run of a session, in the order of their files."""
    recordings = session.of_kind("recording")
    filters = {one.path.name: one for one in session.of_kind("motion")}
    chosen = recordings or list(filters.values())
    return [_run(session, one, filters.get(one.path.name)) for one in chosen]


def _run(session: Session, artifact: Artifact, motion: Artifact | None) -> Run:
    about, time = artifact.metadata, _time(artifact)
    step = np.diff(time)
    usual = float(np.median(step)) if len(step) else float("nan")
    near = step[step < 1.5 * usual] if len(step) else step
    jitter = float(np.subtract(*np.percentile(near, [99, 1]))) / 2 if len(near) else 0.0
    gaps = about.get("gaps") or []
    named = (about.get(key) for key in ("rig", "subject", "session"))
    return Run(
        file=session.shown(artifact.path),
        run=about["run"],
        purpose=about["purpose"],
        about=", ".join(str(one) for one in named if one),
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


def _time(artifact: Artifact) -> np.ndarray:
    contract = RECORDING if artifact.kind == "recording" else MOTION
    pieces = contract.scan(artifact.path).pieces(["time_s"])
    return np.concatenate([piece.column("time_s").to_numpy() for piece in pieces])


def _clock(joint: str, clock: dict[str, Any]) -> str:
    corrected = "corrected" if clock["corrected"] else "not corrected"
    return (
        f"{joint} {1e3 * clock['offset_s']:+.3g} ms and {clock['rate_ppm']:+.3g} ppm, {corrected}"
    )


def _imported(about: Any) -> str:
    if not isinstance(about, dict):
        return ""
    return (
        ", ".join(str(about[key]) for key in ("source", "format") if about.get(key)) or "imported"
    )


def _filter(about: Any) -> str:
    if not isinstance(about, dict):
        return ""
    text = f"{about.get('kind', 'filter')}, {about.get('cutoff_hz', 0):.3g} Hz".replace("_", " ")
    return f"{text}: {about['why']}" if about.get("why") else text
