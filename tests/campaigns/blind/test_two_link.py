"""The closed form of a leg of two links has MuJoCo's equations of motion."""

from dataclasses import replace

import numpy as np
import pytest
from numpy.testing import assert_allclose

from tests.campaigns.blind import two_link
from tests.campaigns.blind.body import PAYLOAD_INERTIA, Body, Leg, Segment
from tests.campaigns.blind.people import Person
from tests.campaigns.blind.plan import HIP, KNEE

BENT = Leg(Segment(4.0, 0.2, 0.05, 0.03), Segment(2.5, 0.18, 0.03, -0.05), 0.41)
"""A leg whose centres of mass lie off their axes."""
LUMP_KG, LUMP_M = 1.3, 0.27


@pytest.fixture
def motion():
    rng = np.random.default_rng(900_300)
    return [rng.uniform(-2.0, 2.0, (200, 2)) for _ in range(3)]


def inverse(leg, motion, tilt=0.0):
    c = two_link.coefficients(leg)
    return two_link.inverse(c, leg.gravity, np.full(len(motion[0]), tilt), *motion)


def test_torques_along_any_motion_are_mujocos(motion):
    assert_allclose(inverse(BENT, motion), Body(BENT).inverse(*motion), atol=1e-10)


def test_a_tilted_base_is_a_hip_turned_otherwise(motion):
    q, dq, ddq = motion
    turned = q + np.array([0.2, 0.0])
    assert_allclose(
        inverse(BENT, motion, tilt=0.2), Body(BENT).inverse(turned, dq, ddq), atol=1e-10
    )


def test_legs_strapped_together_have_the_sum_of_their_coefficients(motion):
    leg = Person(80.0, 1.8).leg
    other = replace(BENT, length=leg.length)
    both = two_link.coefficients(leg) + two_link.coefficients(other)
    assert_allclose(both, two_link.coefficients(leg + other), atol=1e-10)


@pytest.mark.parametrize("joint", [HIP, KNEE])
def test_a_lump_is_a_part_of_its_segment(joint):
    lump = Segment(LUMP_KG, LUMP_M, LUMP_KG * PAYLOAD_INERTIA)
    name = ("thigh", "shank")[joint]
    heavier = replace(BENT, **{name: getattr(BENT, name) + lump})
    out = np.empty(8)
    two_link.add_lump(two_link.coefficients(BENT), joint, LUMP_KG, LUMP_M, BENT.length, out)
    assert_allclose(out, two_link.coefficients(heavier), atol=1e-10)
