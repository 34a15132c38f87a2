"""Models as files hold them, and what exoid itself computes of them."""

from dataclasses import dataclass, replace

import numpy as np
import pandas as pd

from pipelines.contracts.table import Table
from pipelines.dynamics.assembly import assemble
from pipelines.dynamics.forward import DTHETA, accelerations, workspace
from pipelines.effects import Side
from pipelines.effects.baseline import Friction, RigidBody
from pipelines.effects.kernel import Instant
from pipelines.export import exported
from pipelines.export.exported import shift_of
from pipelines.mechanics.motion import Motion
from pipelines.model import Model, Term
from tests.effects.catalogue import TERMS

LEG = (
    Term(RigidBody(), np.array([2.6, 0.63, 1.78, 5.7])),
    Term(Friction("hip"), np.array([2.5, 4.0])),
    Term(Friction("knee"), np.array([1.5, 2.0])),
)
CAUSES = [term for term in TERMS if term.effect.name not in ("rigid_body", "friction")]


@dataclass(frozen=True)
class States:
    """n instants of two joints."""

    t: np.ndarray
    q: np.ndarray
    dq: np.ndarray
    ddq: np.ndarray


def named(label):
    """Return the term of the catalogue that has a label."""
    return next(term for term in TERMS if term.effect.label == label)


def frame_of(terms, run, joints=("hip", "knee")):
    """Return the rows of ``parameters/1``; the catalogue's hip and knee go by the names of
    ``joints``."""
    called = dict(zip(("hip", "knee"), joints, strict=True))
    rows = [
        {
            "name": p.name,
            "symbol": p.symbol,
            "value": float(value),
            "joint": called.get(term.effect.joint, term.effect.joint),
            "run": run if term.effect.name == "rigid_body" else None,
            "unit": p.unit,
            "std_error": 0.1,
            "ci95_low": float(value) - 0.2,
            "ci95_high": float(value) + 0.2,
            "step": "extension",
            "effect": term.effect.name,
        }
        for term in terms
        for p, value in zip(term.effect.parameters, term.effect.physical(term.values), strict=True)
    ]
    return pd.DataFrame(rows)


def table_of(*terms, run="with_human", joints=("hip", "knee"), **metadata):
    """Return a ``parameters/1`` table, as identify and diagnose write it."""
    frame = frame_of(terms, run, joints)
    described = {
        "contract": "parameters/1",
        "mechanism": "leg",
        "geometry": {"thigh_length_m": 0.41, "gravity_m_s2": 9.81},
        "joints": [{"name": name, "kind": "revolute"} for name in joints],
        "covariance": np.diag(np.full(len(frame), 0.01)).tolist(),
    }
    return Table(frame, described | metadata)


def machine(*terms, run="with_human", joints=("hip", "knee")):
    """Return the terms as they are exported."""
    return exported(table_of(*terms, run=run, joints=joints))


def torque(made, states, *, measured=False, memory=0.3):
    """Return what exoid's own kernels say the drives must deliver, (n, J) N·m: each term, one
    instant at a time.

    ``measured`` asks for what the torque channels say instead. Memories hold ``memory``.
    """
    untold = ("spring", "reading_states", "needs_temperature")
    terms = [
        t
        for t in made.model
        if not any(getattr(t.effect, what) for what in untold)
        and (t.effect.reading is None or shift_of(t) is not None)
    ]
    names = [joint.name for joint in made.joints]
    on_links = [t for t in terms if t.effect.side in (Side.STRUCTURE, Side.HUMAN)]
    on_drives = [t for t in terms if t.effect.side is Side.DRIVE]
    motor = at_joints(terms, states, names, sensors=True)
    link = at_joints(terms, replace(states, q=motor), names, sensors=False)
    tau = np.zeros_like(states.q)
    for group, angle in ((on_links, link), (on_drives, motor)):
        load = tau.copy()
        for term in (t for t in group if t.effect.reaction is not None):
            joint = names.index(term.effect.joint) if term.effect.joint else -1
            state = np.full(term.effect.states, memory)
            for k in range(len(states.t)):
                at = Instant(
                    states.t[k],
                    angle[k],
                    states.dq[k],
                    states.ddq[k],
                    np.sign(states.dq[k]),
                    load[k],
                    load[k],
                )
                term.effect.reaction(at, state, term.values, made.geometry.array(), joint, tau[k])
    for term in (t for t in terms if measured and t.effect.torque_reading is not None):
        for k in range(len(states.t)):
            joint = names.index(term.effect.joint)
            term.effect.torque_reading(
                states.t[k], tau[k], term.values, joint, np.zeros(0), np.zeros(2)
            )
    return tau


def at_joints(terms, states, names, *, sensors):
    """Return the angles behind encoders, or behind a tilted base, as the effects' own corrections
    give them."""
    n = len(states.t)
    motion = Motion(
        states.t,
        states.q,
        states.dq,
        states.ddq,
        np.zeros_like(states.q),
        np.arange(n),
        np.ones(n, dtype=bool),
        run="with_human",
        joints=tuple(names),
    )
    for term in terms:
        if (term.effect.side is Side.SENSOR) == sensors:
            motion = term.effect.corrected(motion, term.shape)
    return motion.q


def acceleration(made, states, drive, twist=None):
    """Return how exoid's own forward dynamics accelerates the motors, (n, J) rad/s², from encoders'
    angles."""
    a = assemble(made.model, made.geometry, [joint.name for joint in made.joints])
    w, rates = workspace(a.joints), np.zeros((4, a.joints))
    true = states.q - made.shift()
    twist = np.zeros_like(true) if twist is None else twist
    found = np.empty((len(states.t), 4, a.joints))
    still = np.zeros(a.joints)
    for k in range(len(states.t)):
        state = np.array([true[k] - twist[k], states.dq[k], true[k], states.dq[k]])
        accelerations(
            a, w, states.t[k], state, np.zeros(0), np.sign(states.dq[k]), still, drive[k], rates
        )
        found[k] = rates
    return found[:, DTHETA], found[:, 1]


def without_transmissions(terms):
    """Return the terms of which a simulation can have any number."""
    return [term for term in terms if term.effect.spring is None]


def together():
    """Return every cause that can be beside all others in one model."""
    return Model((*LEG, *without_transmissions(CAUSES)))
