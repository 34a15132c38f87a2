"""A level arm of two links, moved by MuJoCo under sampled feedback, as recordings."""

import mujoco
import numpy as np
import pandas as pd

from pipelines.contracts.table import Table
from tests.diagnosis.machines import PERIOD_S, RATE_HZ, excitation

LENGTH, MASSES, CENTRES, INERTIAS = 0.4, (4.0, 2.0), (0.2, 0.15), (0.06, 0.02)
COULOMB, VISCOUS = (0.8, 0.4), (0.5, 0.3)
X3 = MASSES[1] * CENTRES[1]
X2 = MASSES[1] * CENTRES[1] ** 2 + INERTIAS[1]
X1 = MASSES[0] * CENTRES[0] ** 2 + INERTIAS[0] + MASSES[1] * LENGTH**2 + X2
TRUTH = [X1, X2, X3, COULOMB[0], VISCOUS[0], COULOMB[1], VISCOUS[1]]

ARM = f"""
<mujoco>
  <compiler angle="radian"/>
  <default><joint solreffriction="0.002 1"/></default>
  <option gravity="0 0 -9.81" timestep="0.001" integrator="implicitfast"/>
  <worldbody>
    <body>
      <joint name="shoulder" axis="0 0 1" damping="{VISCOUS[0]}" frictionloss="{COULOMB[0]}"/>
      <inertial pos="{CENTRES[0]} 0 0" mass="{MASSES[0]}" diaginertia="0.06 0.06 {INERTIAS[0]}"/>
      <body pos="{LENGTH} 0 0">
        <joint name="elbow" axis="0 0 1" damping="{VISCOUS[1]}" frictionloss="{COULOMB[1]}"
               stiffness="%g" springref="0.3"/>
        <inertial pos="{CENTRES[1]} 0 0" mass="{MASSES[1]}" diaginertia="0.02 0.02 {INERTIAS[1]}"/>
      </body>
    </body>
  </worldbody>
</mujoco>
"""


def planar_arm(purpose, seed, spring=0.0, seconds=25.0):
    """Return a ``recording/1`` table of the arm, with a spring of so many N·m/rad at its elbow."""
    model = mujoco.MjModel.from_xml_string(ARM % spring)
    data = mujoco.MjData(model)
    joints = [excitation(10 * seed + j, size) for j, size in enumerate((0.6, 0.8))]
    data.qpos[:], data.qvel[:] = ([f(0.0)[0] for f in each] for each in zip(*joints, strict=True))
    every = round(1.0 / RATE_HZ / model.opt.timestep)
    rows = []
    for k in range(round(seconds * RATE_HZ)):
        at = k / RATE_HZ
        asked, speed = (np.array([f(at)[0] for f in each]) for each in zip(*joints, strict=True))
        torque = np.array([300.0, 100.0]) * (asked - data.qpos) + np.array([20.0, 6.0]) * (
            speed - data.qvel
        )
        rows.append((at, *data.qpos, *torque))
        data.qfrc_applied[:] = torque
        for _ in range(every):
            mujoco.mj_step(model, data)
    frame = pd.DataFrame(
        rows,
        columns=[
            "time_s",
            "shoulder_angle_rad",
            "elbow_angle_rad",
            "shoulder_torque_nm",
            "elbow_torque_nm",
        ],
    )
    noise = np.random.default_rng(seed).normal(0, 0.05, (len(frame), 2))
    frame[["shoulder_torque_nm", "elbow_torque_nm"]] += noise
    metadata = {
        "contract": "recording/1",
        "run": "exo_alone",
        "purpose": purpose,
        "sample_rate_hz": RATE_HZ,
        "period_s": PERIOD_S,
        "joints": [{"name": name, "kind": "revolute"} for name in ("shoulder", "elbow")],
        "geometry": {"thigh_length_m": LENGTH, "gravity_m_s2": 0.0},
    }
    return Table(frame, metadata, None)
