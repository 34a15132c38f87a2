"""When a joint stands still."""

import numpy as np
import pandas as pd
from numpy.typing import NDArray

from pipelines.contracts import Joint

SLOW = 0.1
"""Share of its rms speed below which a joint counts as standing."""


def moving(frame: pd.DataFrame, joint: Joint) -> NDArray[np.bool_]:
    """Return whether the measured joint moved throughout the window of each row.

    Parameters
    ----------
    frame : DataFrame of n rows
        A replay: ``time_s``, ``window``, and the measured angle as reference.
    joint : Joint

    Returns
    -------
    (n,) array of bool
    """
    time, place = (frame[name].to_numpy() for name in ("time_s", joint.column("reference")))
    windows = frame["window"].to_numpy()
    # Speed is measured over 0.1 s, so that encoder noise does not count as motion.
    span = max(1, round(0.1 / float(np.median(np.diff(time)))))
    moved, within = place[span:] - place[:-span], windows[span:] == windows[:-span]
    slow = np.abs(moved) < SLOW * np.sqrt(np.mean(moved[within] ** 2))
    # One slow stretch excludes its whole window, whose error lasts to the window's end.
    return ~np.isin(windows, windows[span:][within & slow])
