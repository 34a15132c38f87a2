"""A spring that is no straight line is a spring, and nothing is named for its bend."""

from dataclasses import replace

import numpy as np
import pytest

from pipelines.contracts.table import Table
from pipelines.diagnosis.diagnose import diagnose
from pipelines.mechanics.kinematics import motion_table
from pipelines.mechanics.motion import motion_from_table
from pipelines.settings.filter import FilterSettings
from tests.diagnosis.sessions import recordings

LAWS = {
    "a cable that only pulls": lambda q: 14.0 * np.maximum(q + 0.9, 0.0),
    "a spring that hardens": lambda q: 4.0 * (q + 0.5) + 10.0 * (q + 0.5) ** 3,
    "a spring that softens": lambda q: 5.0 * np.tanh(2.5 * (q + 0.8)),
}


@pytest.mark.parametrize("law", LAWS)
def test_a_spring_of_any_form_is_named_alone(law):
    def with_spring(table: Table) -> Table:
        frame = table.frame.copy()
        frame["knee_torque_nm"] += LAWS[law](frame["knee_angle_rad"].to_numpy())
        return replace(table, frame=frame)

    motions = [motion_from_table(motion_table(with_spring(t), FilterSettings())) for t in recordings(seed=4)]
    found = diagnose([replace(motion, file=f"run_{i}.parquet") for i, motion in enumerate(motions)])
    assert found.causes == ("parallel_spring@knee",)
