"""Compare two excitations before anything moves: how well each separates the parameters."""

import numpy as np

from pipelines.design.quality import quality
from pipelines.mechanics.fourier import FourierTrajectory
from pipelines.mechanics.geometry import Geometry
from pipelines.settings.design import DesignSettings

# Hip and knee, rad: one slow sine each, and three harmonics that turn at different angles.
SINE = FourierTrajectory(
    theta0=np.array([0.65, -0.93]),
    a=np.array([[0.5], [0.6]]),
    b=np.array([[0.0], [0.2]]),
    omega=0.4 * np.pi,
)
RICH = FourierTrajectory(
    theta0=np.array([0.65, -0.93]),
    a=np.array([[0.22, -0.16, 0.10], [0.12, 0.24, -0.11]]),
    b=np.array([[0.10, 0.12, -0.07], [-0.22, 0.08, 0.10]]),
    omega=0.4 * np.pi,
)

qualities = {
    name: quality(motion, DesignSettings(), Geometry())
    for name, motion in (("sine", SINE), ("rich", RICH))
}

print(f"{'':22s}" + "".join(f"{name:>10s}" for name in qualities))
print(
    f"{'condition number':22s}"
    + "".join(f"{motion.condition:10.1f}" for motion in qualities.values())
)
print(f"{'log det':22s}" + "".join(f"{motion.log_det:10.2f}" for motion in qualities.values()))
for parameter, unit in qualities["rich"].units.items():
    errors = "".join(f"{motion.standard_errors[parameter]:10.4f}" for motion in qualities.values())
    print(f"{'± ' + parameter:22s}{errors} {unit}")

assert qualities["rich"].log_det > qualities["sine"].log_det
