"""What is recorded through a bad line identifies the same leg."""

from pathlib import Path

import numpy as np
import pytest

from pipelines.contracts.table import Table
from pipelines.identification.two_step import identify
from pipelines.mechanics.kinematics import motion_table
from pipelines.mechanics.motion import motion_from_table
from pipelines.settings.filter import FilterSettings
from pipelines.settings.rig import load_rig
from tests.campaigns.faults.faults import (
    EXCHANGE,
    another_unit,
    cut,
    delay,
    lose,
    nothing,
    other_transaction,
    twice,
)
from tests.campaigns.faults.runs import RATE, rig_file, run_through

DURATION_S = 10.0
RICH = """\
unit = "rad"
omega_rad_s = 1.2566370614359172
theta0_rad = [0.65, -0.93]
a = [[0.22, -0.16, 0.10], [0.12, 0.24, -0.11]]
b = [[0.10, 0.12, -0.07], [-0.22, 0.08, 0.10]]
"""
REPLY_S = 0.1


class BadLine:
    """Every so many replies something befalls one that a run survives, one thing after the
    other."""

    def __init__(self, every):
        late = delay(1.5 * REPLY_S), delay(0.2 * REPLY_S)
        self.befalls = [lose, *late, twice, cut, other_transaction, another_unit]
        self.every, self.seen, self.struck = every, 0, 0

    def __call__(self, frame, link):
        if not frame.is_reply or frame.function != EXCHANGE:
            return [frame.raw]
        self.seen += 1
        if self.seen % self.every:
            return [frame.raw]
        self.struck += 1
        return self.befalls[self.struck % len(self.befalls)](frame, link)


@pytest.fixture(scope="module")
def recorded(tmp_path_factory):
    """A run through a bad line, and the same run without faults."""
    results = {}
    for name, fault in {"bad": BadLine(every=61), "good": nothing}.items():
        folder = tmp_path_factory.mktemp(name)
        # A set-point that was lost jerks the leg: that shall be recorded here, not end the run.
        changes = {"ramp_s": 1.0, "torque_nm": 1e4, "reply_s": REPLY_S, "watchdog_s": 5.0}
        results[name] = run_through(fault, folder, duration_s=DURATION_S, motion=RICH, **changes)
    return results


def parameters(result, other):
    motions = [
        motion_from_table(
            motion_table(
                Table(one.frame, {**one.metadata, "purpose": purpose}, Path(purpose)),
                FilterSettings(),
            )
        )
        for one, purpose in ((result, "train"), (other, "validate"))
    ]
    return identify(motions).parameters


def test_a_bad_line_leaves_gaps_and_nothing_else(recorded):
    for result in recorded.values():
        assert (result.why, result.wrong) == (None, 0)
        assert len(result.frame) + result.missing == DURATION_S * RATE
    assert len(recorded["bad"].metadata["gaps"]) > 10


def test_what_a_bad_line_brought_identifies_the_same_leg_within_its_intervals(recorded, tmp_path):
    bad, good = recorded["bad"], recorded["good"]
    with_faults, without_faults = parameters(bad, good), parameters(good, good)
    plant = load_rig(rig_file(tmp_path, 502)).plant
    truth = [
        *plant.exo_inertial,
        *np.column_stack([plant.coulomb_nm, plant.viscous_nm_s_rad]).ravel(),
    ]
    low, high = with_faults["ci95_low"].to_numpy(), with_faults["ci95_high"].to_numpy()
    assert ((low <= without_faults["value"]) & (without_faults["value"] <= high)).all()
    assert ((low <= truth) & (truth <= high)).all()
