"""What those who recorded the data published of their machines."""

from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from pipelines.effects.baseline import RigidBody
from pipelines.effects.rotor_coupling import RotorCoupling
from pipelines.effects.rotor_inertia import RotorInertia
from pipelines.mechanics.motion import Motion
from pipelines.model import Model, Term

EMPS = {"X1": 95.1089, "Km": 203.5034, "Ks": 20.3935, "o": -3.1648}
"""Symmetric friction: kg, N·s/m, N, N."""
EMPS_ERRORS = {"symmetric": (4.09, 6.16), "asymmetric": (3.12, 5.6)}
"""Percent on the run that was fitted and on the other: what the issue asks to reach."""


def double_pendulum(file: Path) -> dict[str, float]:
    """Return the parameters that the makers of the double pendulum give, by their names."""
    lines = (
        line.split(":") for line in file.read_text(encoding="utf-8").splitlines() if ":" in line
    )
    return {name.strip(): float(value) for name, value in lines}


def their_torque(p: dict[str, float], motion: Motion) -> NDArray:
    """Return the torque (n, 2) N·m that the makers' model has along a motion.

    Inertias I are about the joints' axes, r are the centres of mass. A rotor Ir behind a gear gr is
    carried by the link before it and turns against it: Ir + gr² Ir at the first joint, gr² Ir at
    the second, -gr Ir between them.
    """
    on, second = motion.machine, motion.joints[1]
    reflected = p["gr"] ** 2 * p["Ir"]
    X1 = p["I1"] + p["I2"] + p["m2"] * p["l1"] ** 2 + reflected + p["Ir"]
    rigid = np.array([X1, p["I2"], p["m2"] * p["r2"], p["m1"] * p["r1"] + p["m2"] * p["l1"]])
    model = Model(
        (
            Term(RigidBody(on=on), rigid),
            Term(RotorInertia(second, on=on), np.array([reflected])),
            Term(RotorCoupling(second, on=on), np.array([-p["gr"] * p["Ir"]])),
        )
    )
    viscous, coulomb = np.array([p["b1"], p["b2"]]), np.array([p["cf1"], p["cf2"]])
    return model.torque(motion) + viscous * motion.dq + coulomb * np.arctan(100.0 * motion.dq)
