"""The leg as MuJoCo sees it: two links on hinges, and compiled access to its equations of motion.

Nothing here is shared with the code under test: mass matrix and bias come from libmujoco, called by
address out of compiled loops.
"""

from dataclasses import dataclass
from pathlib import Path

import llvmlite.binding
import mujoco
import numpy as np
from numba import types
from numpy.typing import NDArray

from tests.campaigns.blind.compiled import njit

llvmlite.binding.load_library_permanently(
    str(next(Path(mujoco.__file__).parent.glob("libmujoco.so*")))
)
_PASS = types.void(types.intp, types.intp)
_kinematics = types.ExternalFunction("mj_kinematics", _PASS)
_com_pos = types.ExternalFunction("mj_comPos", _PASS)
_inertia = types.ExternalFunction("mj_crb", _PASS)
_com_vel = types.ExternalFunction("mj_comVel", _PASS)
_newton_euler = types.ExternalFunction(
    "mj_rne", types.void(types.intp, types.intp, types.int32, types.intp)
)

PAYLOAD_INERTIA = 1e-3
"""kg·m² per kg of a payload, about its own centre."""


@dataclass(frozen=True)
class Segment:
    """A rigid link: mass (kg), centre of mass along and in front of its axis (m), inertia about
    that centre (kg·m²)."""

    mass: float
    along: float
    inertia: float
    forward: float = 0.0

    def __add__(self, other: "Segment") -> "Segment":
        """Return both as one rigid link (parallel axes)."""
        mass = self.mass + other.mass
        along = (self.mass * self.along + other.mass * other.along) / mass
        forward = (self.mass * self.forward + other.mass * other.forward) / mass
        inertia = sum(
            s.inertia + s.mass * ((s.along - along) ** 2 + (s.forward - forward) ** 2)
            for s in (self, other)
        )
        return Segment(mass, along, inertia, forward)


@dataclass(frozen=True)
class Leg:
    """Thigh and shank; SI units."""

    thigh: Segment
    shank: Segment
    length: float
    gravity: float = 9.81

    def __add__(self, other: "Leg") -> "Leg":
        """Return both legs strapped together."""
        return Leg(self.thigh + other.thigh, self.shank + other.shank, self.length, self.gravity)

    def inertial(self) -> NDArray:
        """X1..X4 of the leg: what an identification should find where the centres lie on the
        axes."""
        t, s = self.thigh, self.shank
        X2 = s.mass * s.along**2 + s.inertia
        X1 = t.mass * t.along**2 + t.inertia + s.mass * self.length**2 + X2
        return np.array([X1, X2, s.mass * s.along, t.mass * t.along + s.mass * self.length])


@dataclass(frozen=True)
class Payload:
    """A lump on a segment (0 thigh, 1 shank), ``distance`` m down its axis; its mass is set as time
    goes by."""

    joint: int
    distance: float


class Body:
    """A MuJoCo model and its data, and the arrays through which a compiled loop talks to them."""

    def __init__(self, leg: Leg, wearer: Leg | None = None, payload: Payload | None = None) -> None:
        self.model = mujoco.MjModel.from_xml_string(mjcf(leg, wearer, payload))
        self.data = mujoco.MjData(self.model)
        self.payload = self.model.body("payload").id if payload else -1

    @property
    def handles(self) -> tuple:
        """What the compiled loop takes: addresses, state, bias, mass matrix (lower triangle),
        masses, gravity."""
        m, d = self.model, self.data
        pattern = np.array([m.M_rowadr, m.M_rownnz]).astype(np.int64)
        return (
            m._address,
            d._address,
            d.qpos,
            d.qvel,
            d.qacc,
            d.qfrc_bias,
            d.M,
            pattern,
            m.M_colind.astype(np.int64),
            m.body_mass,
            m.body_subtreemass,
            m.body_inertia,
            m.opt.gravity,
        )

    def inverse(self, q: NDArray, dq: NDArray, ddq: NDArray) -> NDArray:
        """Torque that moves the leg along a motion, (n, 2) N·m."""
        m, d = self.model, self.data
        arrays = [np.ascontiguousarray(x) for x in (q, dq, ddq)]
        return _inverse(m._address, d._address, d.qpos, d.qvel, d.qacc, d.qfrc_bias, *arrays)


def mjcf(leg: Leg, wearer: Leg | None = None, payload: Payload | None = None) -> str:
    """Return the model: hinges turn about -y, so that with z up and the leg hanging, forward (x) is
    positive.

    A wearer who is not one with the machine hangs next to it as a second leg.
    """
    inside = ["", ""]
    if payload:
        inside[payload.joint] += (
            f'<body name="payload" pos="0 0 {-payload.distance!r}"><inertial pos="0 0 0" mass="1" '
            f'diaginertia="{PAYLOAD_INERTIA} {PAYLOAD_INERTIA} {PAYLOAD_INERTIA}"/></body>'
        )
    legs = _chain(leg, inside) + (_chain(wearer, ["", ""]) if wearer else "")
    return f'<mujoco><option gravity="0 0 {-leg.gravity!r}"/><worldbody>{legs}</worldbody></mujoco>'


def _chain(leg: Leg, inside: list[str]) -> str:
    hinge = '<joint axis="0 -1 0"/>'
    shank = f'<body pos="0 0 {-leg.length!r}">{hinge}{_inertial(leg.shank)}{inside[1]}</body>'
    return f"<body>{hinge}{_inertial(leg.thigh)}{inside[0]}{shank}</body>"


def _inertial(s: Segment) -> str:
    # Only the inertia about the hinges' direction matters; the others keep MuJoCo's triangle
    # inequality.
    return (
        f'<inertial pos="{s.forward!r} 0 {-s.along!r}" mass="{s.mass!r}" '
        f'diaginertia="{s.inertia!r} {s.inertia!r} {s.inertia!r}"/>'
    )


@njit()
def evaluate(model, data, bias):
    """Bring mass matrix and bias torque (Coriolis, gravity) up to the state in qpos and qvel."""
    _kinematics(model, data)
    _com_pos(model, data)
    _inertia(model, data)
    _com_vel(model, data)
    _newton_euler(model, data, 0, bias.ctypes.data)


@njit()
def _inverse(model, data, qpos, qvel, qacc, bias, q, dq, ddq):
    torque = np.empty_like(q)
    for k in range(len(q)):
        qpos[:], qvel[:], qacc[:] = q[k], dq[k], ddq[k]
        _kinematics(model, data)
        _com_pos(model, data)
        _com_vel(model, data)
        _newton_euler(model, data, 1, bias.ctypes.data)
        torque[k] = bias
    return torque
