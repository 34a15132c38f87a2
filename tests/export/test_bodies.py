"""Nominal bodies: chosen where the data are silent, true to what was identified."""

import numpy as np
import pytest

from pipelines.errors import InputError
from pipelines.export.bodies import bodies
from pipelines.mechanics.geometry import Geometry
from pipelines.mechanics.mechanisms.leg import LEG as MECHANISM
from tests.export.machines import LEG, machine, named

LENGTH = 0.41


def random_legs(n, seed=0):
    """Return realizable X of all proportions."""
    random = np.random.default_rng(seed)
    for _ in range(n):
        X2, X3, X4 = random.uniform(0.05, 5.0), random.uniform(-3.0, 3.0), random.uniform(-3.0, 9.0)
        X1 = X2 + (LENGTH * X3) ** 2 / X2 * random.uniform(1.001, 4.0) + random.uniform(1e-3, 1.0)
        yield np.array([X1, X2, X3, X4])


def leg_of(X, *more):
    body, *friction = LEG
    return machine(type(body)(body.effect, np.asarray(X, dtype=float)), *friction, *more)


def test_bodies_have_the_identified_parameters_whatever_the_leg():
    for X in random_legs(60):
        thigh, shank = bodies(leg_of(X))
        X2 = shank.mass * (shank.along**2 + shank.across**2) + shank.inertia
        X3 = shank.mass * shank.along
        X4 = thigh.mass * thigh.along + shank.mass * LENGTH
        X1 = (
            thigh.mass * (thigh.along**2 + thigh.across**2)
            + thigh.inertia
            + shank.mass * LENGTH**2
            + X2
        )
        np.testing.assert_allclose([X1, X2, X3, X4], X, rtol=1e-12, atol=1e-12)
        assert min(thigh.mass, shank.mass, thigh.inertia, shank.inertia) > 0


def test_a_mass_off_the_axis_moves_the_centre_and_keeps_the_inertia():
    thigh, shank = bodies(
        leg_of([2.6, 0.63, 1.2, 5.7], named("mass_off_axis@hip"), named("mass_off_axis@knee"))
    )
    assert shank.mass * shank.across == pytest.approx(0.25, rel=1e-12)
    assert thigh.mass * thigh.across == pytest.approx(0.25, rel=1e-12)
    assert shank.mass * (shank.along**2 + shank.across**2) + shank.inertia == pytest.approx(
        0.63, rel=1e-12
    )


def test_bodies_exist_exactly_where_the_mass_matrix_is_positive_definite():
    random = np.random.default_rng(1)
    agreed = {True: 0, False: 0}
    for _ in range(80):
        X = np.array(
            [
                random.uniform(0.1, 4),
                random.uniform(-0.2, 2),
                random.uniform(-2, 2),
                random.uniform(-2, 6),
            ]
        )
        real = not MECHANISM.unrealizable(X, Geometry(LENGTH, 9.81))
        agreed[real] += 1
        if real:
            bodies(leg_of(X))
        else:
            with pytest.raises(InputError, match="not those of a real leg"):
                leg_of(X)
    assert min(agreed.values()) > 10


def test_a_leg_that_only_its_rotor_makes_real_has_no_bodies_but_an_inverse_dynamics():
    X = [2.0, 0.30, 1.8, 5.0]
    assert MECHANISM.unrealizable(X, Geometry(LENGTH, 9.81))
    made = leg_of(X, named("rotor_inertia@knee"))
    with pytest.raises(
        InputError,
        match=r"no two bodies have the rigid body of with_human: X2 = 0\.3 .* export to c",
    ):
        bodies(made)
