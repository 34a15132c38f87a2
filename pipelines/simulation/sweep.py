"""How the tracking error falls with the feedback gain."""

from collections.abc import Iterable

import pandas as pd

from pipelines.dynamics.plant import Plant
from pipelines.dynamics.tracking import track
from pipelines.mechanics.trajectory import Trajectory
from pipelines.settings.simulate import SimulateSettings


def sweep(
    plant: Plant, settings: SimulateSettings, reference: Trajectory, gains: Iterable[float]
) -> pd.DataFrame:
    """Return the largest settled error for each feedback gain (the paper's Figure 3).

    Columns ``feedback_gain_nm_s_rad`` and, for each joint, its error in rad; NaN where the loop ran
    away.
    """
    rows = []
    for gain in gains:
        worst = track(plant, settings, reference, gain).worst_error(settings.settled_after_s)
        errors = {
            joint.column("error"): error for joint, error in zip(plant.joints, worst, strict=True)
        }
        rows.append({"feedback_gain_nm_s_rad": gain, **errors})
    return pd.DataFrame(rows)
