"""Recordings whose motion is known in closed form."""

import numpy as np
import pandas as pd

from pipelines.contracts.table import Table

RATE_HZ = 200.0
W = 2 * np.pi * 0.5


def recording(time, noise_rad=0.0, **metadata):
    rng = np.random.default_rng(0)
    angle = {joint: a * np.sin(W * time + a) for joint, a in (("hip", 0.5), ("knee", 0.7))}
    frame = pd.DataFrame({"time_s": time})
    for joint, q in angle.items():
        frame[f"{joint}_angle_rad"] = q + noise_rad * rng.standard_normal(len(time))
        frame[f"{joint}_torque_nm"] = rng.standard_normal(len(time))
        frame[f"{joint}_velocity_rad_s"] = np.gradient(q, time)
    described = {"run": "exo_alone", "purpose": "train", "sample_rate_hz": RATE_HZ, **metadata}
    return Table(frame, described)


def grid(seconds):
    return np.arange(0, seconds, 1 / RATE_HZ)
