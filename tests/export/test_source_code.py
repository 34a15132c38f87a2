"""What is exported as source computes what exoid computes, to rounding."""

import ctypes

import numpy as np
import pytest

from pipelines.effects.kernel import Instant
from pipelines.export import C, Degree
from tests.export.machines import CAUSES, LEG, machine, together, torque
from tests.mechanics.equations import coriolis_matrix, gravity_torque

HELD = [term for term in CAUSES if C.holding(term).degree is Degree.EXACT]
RELATIVE = 1e-12


def stem_of(term):
    return term.effect.label.replace("@", "_at_")


@pytest.fixture(scope="module")
def models():
    """The bare leg, the leg with each cause, the leg with all of them."""
    each = {stem_of(term): machine(*LEG, term) for term in HELD}
    return {"bare": machine(*LEG), "everything": machine(*together())} | each


@pytest.fixture(scope="module")
def library(compiled, models):
    return compiled(models)


@pytest.fixture(scope="module")
def octave(in_octave, models, states):
    return in_octave(models, few(states))


def few(states):
    """Octave interprets: a dozen instants are enough."""
    return type(states)(*(part[:12] for part in (states.t, states.q, states.dq, states.ddq)))


def pointer(array):
    return array.ctypes.data_as(ctypes.POINTER(ctypes.c_double))


def in_c(library, stem, states, memory=0.3):
    """Return torque, reading and mass matrix as the C library gives them."""
    tau, reading, M = (
        np.empty_like(states.q),
        np.empty_like(states.q),
        np.empty((*states.q.shape, states.q.shape[1])),
    )
    state = np.full(64, memory)
    for k in range(len(states.t)):
        t = ctypes.c_double(states.t[k])
        arrays = [np.ascontiguousarray(part[k]) for part in (states.q, states.dq, states.ddq)]
        getattr(library, f"{stem}_inverse_dynamics")(
            t, *map(pointer, arrays), pointer(state), pointer(tau[k])
        )
        reading[k] = tau[k]
        getattr(library, f"{stem}_torque_reading")(t, pointer(reading[k]))
        getattr(library, f"{stem}_mass_matrix")(t, pointer(arrays[0]), pointer(M[k]))
    return tau, reading, M


def agree(found, expected):
    np.testing.assert_allclose(found, expected, rtol=0.0, atol=RELATIVE * np.abs(expected).max())


@pytest.mark.parametrize("stem", ["bare", "everything", *map(stem_of, HELD)])
def test_torque_in_c_is_ours(stem, library, models, states):
    tau, reading, _ = in_c(library, stem, states)
    agree(tau, torque(models[stem], states))
    agree(reading, torque(models[stem], states, measured=True))


@pytest.mark.parametrize("stem", ["bare", "everything", *map(stem_of, HELD)])
def test_torque_in_octave_is_ours(stem, octave, models, states):
    agree(octave[stem]["tau"], torque(models[stem], few(states)))
    agree(octave[stem]["reading"], torque(models[stem], few(states), measured=True))


def test_the_model_that_the_regression_fits_is_the_one_in_c(library, models, states):
    """The whole model's torque, by the regressor that identification and diagnosis use."""
    from pipelines.mechanics.motion import Motion

    made, n = models["bare"], len(states.t)
    motion = Motion(
        states.t,
        states.q,
        states.dq,
        states.ddq,
        np.zeros_like(states.q),
        np.arange(n),
        np.ones(n, dtype=bool),
        run="with_human",
        geometry=made.geometry,
    )
    agree(in_c(library, "bare", states)[0], made.model.torque(motion))


def test_mass_coriolis_and_gravity_in_octave_are_ours(octave, models, states):
    made, at = models["bare"], few(states)
    ours = made.machine.mechanism
    for k in range(len(at.t)):
        agree(octave["bare"]["M"][k], ours.mass_matrix(at.q[k], made.X, made.geometry))
        agree(
            octave["bare"]["C"][k], coriolis_matrix(ours, at.q[k], at.dq[k], made.X, made.geometry)
        )
        agree(octave["bare"]["G"][k], gravity_torque(ours, at.q[k], made.X, made.geometry))


def test_mass_matrices_in_c_and_octave_are_the_same(library, octave, states):
    for stem in ("bare", "everything", "rotor_inertia_at_knee", "payload_change_at_knee"):
        agree(in_c(library, stem, few(states))[2], octave[stem]["M"])


def test_a_memory_moves_as_ours_does(library, octave, models, states):
    stem, at = "presliding_hysteresis_at_knee", few(states)
    made = models[stem]
    (term,) = (t for t in made.terms if t.effect.states)
    expected, found = np.zeros((len(at.t), 1)), np.zeros((len(at.t), 1))
    memory = np.full(1, 0.3)
    for k in range(len(at.t)):
        now = Instant(
            at.t[k], at.q[k], at.dq[k], np.zeros(2), np.sign(at.dq[k]), np.zeros(2), np.zeros(2)
        )
        term.effect.derivative(now, memory, term.values, made.geometry.array(), 1, expected[k])
        arrays = [np.ascontiguousarray(part[k]) for part in (at.q, at.dq)]
        library[f"{stem}_memory_rate"](
            ctypes.c_double(at.t[k]), *map(pointer, arrays), pointer(memory), pointer(found[k])
        )
    agree(found, expected)
    agree(octave[stem]["rate"], expected)
