"""A leg with friction, and its recording under its own drives."""

import numpy as np
import pytest

from pipelines.dynamics.assembly import assemble
from pipelines.dynamics.pd_loop import follow, loop_at_rest, make_drives
from pipelines.effects.baseline import Friction, RigidBody
from pipelines.mechanics.geometry import Geometry
from pipelines.mechanics.motion import Motion
from pipelines.model import Model, Term
from pipelines.signals.low_pass import derivative, low_pass

RATE_HZ, CUTOFF_HZ = 200.0, 15.0
GEOMETRY = Geometry()


@pytest.fixture(scope="session")
def leg() -> Model:
    friction = (Term(Friction(joint), np.array([3.0, 4.0])) for joint in ("hip", "knee"))
    return Model((Term(RigidBody(), np.array([2.6, 0.63, 1.78, 5.7])), *friction))


def record(model: Model, seconds: float = 12.0) -> Motion:
    """Move a leg by PD drives and filter what their ideal encoders saw."""
    time = (np.arange(round(seconds * RATE_HZ)) + 0.5) / RATE_HZ
    reference = np.column_stack(
        [
            0.6 + 0.35 * np.sin(1.3 * time) + 0.1 * np.cos(3.1 * time),
            -0.9 + 0.4 * np.sin(1.9 * time + 1.0) + 0.1 * np.cos(3.8 * time),
        ]
    )
    a = assemble(model, GEOMETRY)
    drives = make_drives(
        np.array([1500.0, 600.0]),
        np.array([120.0, 40.0]),
        np.array([200.0] * 2),
        np.zeros(2),
        1000.0,
        RATE_HZ,
    )
    angle, _, torque, _ = follow(a, drives, loop_at_rest(a, reference[0]), reference, 0.0)
    q = low_pass(angle, RATE_HZ, CUTOFF_HZ)
    valid = np.ones(len(time), dtype=bool)
    # The start from rest is a kink that the filter rounds off.
    valid[:100] = valid[-40:] = False
    return Motion(
        time,
        q,
        derivative(q, RATE_HZ, 1),
        derivative(q, RATE_HZ, 2),
        torque,
        np.zeros(len(time), dtype=np.int64),
        valid,
        sample_rate_hz=RATE_HZ,
        cutoff_hz=CUTOFF_HZ,
        reference=reference,
    )


@pytest.fixture(scope="session")
def recorded(leg) -> Motion:
    return record(leg)


@pytest.fixture(scope="session", name="record")
def recorder():
    return record
