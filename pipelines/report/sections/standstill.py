"""Where naming the causes makes a simulation worse, and what the files tell of why: standstill,
mostly."""

from collections.abc import Iterator
from typing import Any

import numpy as np
import pandas as pd
from numpy.typing import NDArray

from pipelines.contracts import Joint
from pipelines.contracts.joints import the
from pipelines.model import BY_NAME
from pipelines.report.numbers import digits
from pipelines.report.session import Session

SLOW = 0.1
"""Share of its rms speed below which a joint is taken for standing."""
OVER_S = 0.1
"""Over which speed is measured: an encoder's noise is no motion."""
NOTABLE = 1.1
"""How many times a simulation's error must grow for words to be made of it."""


def moving(frame: pd.DataFrame, joint: Joint) -> NDArray[np.bool_]:
    """Return (n,) whether each row of a replay is of a second in which the machine's joint never
    stood."""
    time, place = (frame[name].to_numpy() for name in ("time_s", joint.column("reference")))
    windows = frame["window"].to_numpy()
    span = max(1, round(OVER_S / float(np.median(np.diff(time)))))
    moved, within = place[span:] - place[:-span], windows[span:] == windows[:-span]
    slow = np.abs(moved) < SLOW * np.sqrt(np.mean(moved[within] ** 2))
    return ~np.isin(windows, windows[span:][within & slow])


def worse(session: Session) -> list[str]:
    """Return a sentence for each way in which the causes make things worse at a joint, and why as
    far as is known."""
    verdict = session.verdict
    if not verdict or not verdict["causes"]:
        return []
    return [sentence for joint in session.joints for sentence in _at(joint, verdict)]


def torque_error_grew(before: float | None, after: float | None = None, *, floor: float) -> bool:
    """Tell whether a torque error's mean square grows by more than noise has."""
    return before is not None and after is not None and after**2 - before**2 > floor**2


def strays_further(before: float | None, after: float | None = None) -> bool:
    """Tell whether a simulation's error grows by more than a trifle."""
    return before is not None and after is not None and after > NOTABLE * before


def _at(joint: Joint, verdict: dict[str, Any]) -> Iterator[str]:
    name, push = joint.name, joint.effort
    if name not in verdict["noise_floor_nm"]:
        return
    (before, after), (all_before, all_after), (strayed, strays) = (
        (verdict[f"baseline_{key}"][name], verdict[f"extended_{key}"][name])
        for key in ("rmse_nm", "rmse_unmasked_nm", "simulation_rmse_rad")
    )
    known = [
        BY_NAME[cause["effect"]]
        for cause in verdict["causes"]
        if cause["joint"] == name and cause["effect"] in BY_NAME
    ]
    holds = any(effect.holds for effect in known)
    grew = torque_error_grew(all_before, all_after, floor=verdict["noise_floor_nm"][name])
    if grew:
        yield (
            f"Reversals included, {the(name)}'s {push} error is {digits(all_before)} →"
            f" {digits(all_after)} {joint.unit('torque')} with the causes, and {digits(before)} →"
            f" {digits(after)} away from them: a joint that stands is held by any {push} up to the"
            " one that breaks it free, and no model of speed can tell which"
            + (". What is named raises the most that can hold it" if holds else "")
        )
    if strays_further(strayed, strays):
        why = (
            f"nothing corrects such a simulation, and a small error of {push} decides when a joint"
            " that stands comes free; the table of each run tells apart the seconds in which it"
            " never stands"
        )
        yield (
            f"Simulated for 1 s by the recorded {push}, {the(name)} strays {digits(1e3 * strayed)}"
            f" → {digits(1e3 * strays)} m{joint.unit('angle')} with the causes: "
            + (why if grew or holds else "these files do not tell why")
        )
