"""The quality of each recording: from its metadata, and from its time stamps."""

from typing import Any

import numpy as np

from pipelines.contracts import MOTION, RECORDING
from pipelines.report.session import Artifact, Session


def recordings(session: Session) -> list[dict[str, Any]]:
    """Return every run of a session, in the order of their files; motions without recordings."""
    # A motion has the file name of its recording.
    motions = {one.path.name: one for one in session.of_kind("motion")}
    chosen = session.of_kind("recording") or list(motions.values())
    return [_run(session, one, motions.get(one.path.name)) for one in chosen]


def _run(session: Session, artifact: Artifact, motion: Artifact | None) -> dict[str, Any]:
    about, time = artifact.metadata, _time(artifact)
    gaps, rate_hz = about.get("gaps") or [], float(about["sample_rate_hz"])
    step_s, jitter_s = _steps(time)
    imported = _imported(about.get("imported"))
    notes = {
        "imported from": imported,
        "clocks": "; ".join(_clock(*one) for one in (about.get("clocks") or {}).items()),
        "filtered by": _filter(motion.metadata.get("filter")) if motion else "",
    }
    return {
        "file": session.shown(artifact.path),
        "run": about["run"],
        "purpose": about["purpose"],
        "about": origin(artifact),
        "samples": len(time),
        "duration_s": float(time[-1] - time[0]),
        "rate_hz": rate_hz,
        "measured_rate_hz": 1.0 / step_s,
        "rate_is_off": abs(1.0 / step_s / rate_hz - 1.0) > 0.005,
        "jitter_ms": 1e3 * jitter_s,
        # Less than a ten thousandth of a sample period is rounding.
        "is_even": jitter_s * rate_hz < 1e-4,
        "gaps": len(gaps),
        "missing": sum(count for _, count in gaps),
        "abort": about.get("abort"),
        "recovered": about.get("recovered"),
        "latency": about.get("latency"),
        "imported": imported,
        "notes": [f"{words} {note}" for words, note in notes.items() if note],
    }


def _steps(time: np.ndarray) -> tuple[float, float]:
    """Return the usual step of time stamps (n,), NaN of a single one, and its unevenness, s.

    That is half the width of the interval that contains 98 % of the steps.
    """
    step = np.diff(time)
    if not len(step):
        return float("nan"), 0.0
    usual = float(np.median(step))
    # Gaps are counted on their own, and are no jitter.
    high, low = np.percentile(step[step < 1.5 * usual], [99, 1])
    return usual, float(high - low) / 2


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
