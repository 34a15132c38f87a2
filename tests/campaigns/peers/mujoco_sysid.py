"""MuJoCo's sysid toolbox, used as its tests and examples are: a model with position actuators,
rolled out.

The leg is simulated under its drives' gains and set-points, and angle, speed and actuator torque
are compared with what was recorded. Free are the hip's armature, the shank's inertia, both centres
of mass, and friction: as many as the torques can tell apart.
"""

import contextlib
import io
import re
import time
from dataclasses import dataclass

import mujoco
import numpy as np
from mujoco import sysid
from mujoco.sysid.report.sections.insights import AutomatedInsights
from numpy.typing import NDArray

from tests.campaigns.peers.answer import Answer, Log

TIMESTEP_S = 0.002
JOINTS = ("hip", "knee")


def _centre(body: str):
    return lambda spec, p: setattr(spec.body(body), "ipos", [0.0, 0.0, -p.value[0]])


def _armature(spec: mujoco.MjSpec, p: sysid.Parameter) -> None:
    spec.joint("hip").armature = p.value[0]


def _frictionloss(joint: str):
    return lambda spec, p: setattr(spec.joint(joint), "frictionloss", p.value[0])


def _damping(joint: str):
    # Since MuJoCo 4 the coefficients of a polynomial in speed.
    return lambda spec, p: setattr(spec.joint(joint), "damping", [p.value[0], 0.0, 0.0])


def _shank_inertia(spec: mujoco.MjSpec, p: sysid.Parameter) -> None:
    spec.body("shank").inertia = np.repeat(p.value[0], 3)


PARAMETERS = {
    "hip armature": (0.3, 0.001, 5.0, _armature),
    "shank inertia": (0.05, 0.001, 1.0, _shank_inertia),
    "shank centre": (0.2, 0.01, 0.6, _centre("shank")),
    "thigh centre": (0.2, 0.01, 0.6, _centre("thigh")),
    "hip frictionloss": (2.0, 0.0, 20.0, _frictionloss("hip")),
    "knee frictionloss": (2.0, 0.0, 20.0, _frictionloss("knee")),
    "hip damping": (3.0, 0.0, 30.0, _damping("hip")),
    "knee damping": (3.0, 0.0, 30.0, _damping("knee")),
}
"""First guess, bounds, and where it goes; SI units, the same for every leg."""


@dataclass(frozen=True)
class Given:
    """What is told, as a drawing would tell it: all true."""

    masses: NDArray
    """Thigh and shank, kg."""
    thigh_inertia: float
    """About its centre, kg·m²."""

    def to_leg(self, own: NDArray, length: float) -> NDArray:
        """From the free parameters to X1..X4 and friction, (8,)."""
        armature, inertia, shank, thigh = own[:4]
        (m1, m2), X2 = self.masses, inertia + self.masses[1] * shank**2
        X1 = armature + self.thigh_inertia + m1 * thigh**2 + m2 * length**2 + X2
        return np.concatenate([[X1, X2, m2 * shank, m1 * thigh + m2 * length], own[4:]])

    def from_leg(self, values: NDArray, length: float) -> NDArray:
        """Go the other way."""
        (m1, m2), (X1, X2, X3, X4) = self.masses, values[:4]
        shank, thigh = X3 / m2, (X4 - m2 * length) / m1
        armature = X1 - X2 - self.thigh_inertia - m1 * thigh**2 - m2 * length**2
        return np.concatenate([[armature, X2 - m2 * shank**2, shank, thigh], values[4:]])


def identify(log: Log, given: Given) -> Answer:
    """Fit a leg to one run."""
    begun = time.process_time()
    spec = mujoco.MjSpec.from_string(_mjcf(log, given))
    model = spec.compile()
    sequences = sysid.ModelSequences(
        "leg",
        spec,
        "train",
        sysid.create_initial_state(model, log.angle[0], log.velocity[0]),
        sysid.TimeSeries.from_control_names(log.time, _set_points(log), model),
        sysid.TimeSeries.from_names(
            log.time, np.hstack([log.angle, log.velocity, log.torque]), model
        ),
    )
    residual = sysid.build_residual_fn(models_sequences=[sequences])
    with contextlib.redirect_stdout(io.StringIO()):
        found, result = sysid.optimize(
            _parameters(), residual, optimizer="scipy", verbose=False, x_scale="jac"
        )
    left, *_ = residual(found.as_vector(), found)
    _, half_width = sysid.calculate_intervals([r.ravel() for r in left], result.jac)
    insights = AutomatedInsights("Automated Insights", found).get_context()["insights"]
    own = found.as_vector()
    return Answer(
        "MuJoCo sysid",
        given.to_leg(own, log.length),
        list(PARAMETERS),
        own,
        half_width,
        lambda truth: given.from_leg(truth, log.length),
        time.process_time() - begun,
        [re.sub("</?b>", "", f"{i['title']}: {i['message']}") for i in insights],  # it writes HTML
    )


def _set_points(log: Log) -> NDArray:
    """A position actuator's set-points with the drives' feed-forward of speed in them, (n, 2)."""
    return log.reference + log.kd / log.kp * np.gradient(log.reference, log.time, axis=0)


def _parameters() -> sysid.ParameterDict:
    parameters = sysid.ParameterDict()
    for name, (start, lowest, highest, modify) in PARAMETERS.items():
        parameters.add(sysid.Parameter(name, start, lowest, highest, modifier=modify))
    return parameters


def _mjcf(log: Log, given: Given) -> str:
    actuators = "".join(
        f'<position name="{joint}_drive" joint="{joint}" kp="{log.kp[j]}" kv="{log.kd[j]}"/>'
        for j, joint in enumerate(JOINTS)
    )
    sensors = "".join(
        f'<{kind} name="{joint}_{kind}" joint="{joint}"/>'
        for kind in ("jointpos", "jointvel", "jointactuatorfrc")
        for joint in JOINTS
    )
    inertial = '<inertial pos="0 0 -0.2" mass="{}" diaginertia="{i} {i} {i}"/>'
    return f"""<mujoco><compiler angle="radian"/>
<option timestep="{TIMESTEP_S}" integrator="implicitfast" gravity="0 0 -{log.gravity}"/><worldbody>
<body name="thigh"><joint name="hip" axis="0 -1 0"/>
{inertial.format(given.masses[0], i=given.thigh_inertia)}
<body name="shank" pos="0 0 -{log.length}"><joint name="knee" axis="0 -1 0"/>
{inertial.format(given.masses[1], i=0.05)}
</body></body></worldbody><actuator>{actuators}</actuator><sensor>{sensors}</sensor></mujoco>"""
