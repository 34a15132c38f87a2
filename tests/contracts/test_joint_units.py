import pytest

from pipelines.contracts.joint_units import Scale, unit_at, unit_of

LARGER = Scale(torque=2.0, speed=3.0, travel=5.0)
"""A joint of twice the torque, three times the speed and five times the travel."""


@pytest.mark.parametrize(
    ("unit", "prismatic", "ratio"),
    [
        ("N·m", "N", 2),
        ("N·m/°C", "N/°C", 2),
        ("N·m/°C²", "N/°C²", 2),
        ("N·m/s", "N/s", 2),
        ("N·m·s/rad", "N·s/m", 2 / 3),
        ("N·m·s/(rad·°C)", "N·s/(m·°C)", 2 / 3),
        ("N·m·s²/rad²", "N·s²/m²", 2 / 3**2),
        ("N·m/rad", "N/m", 2 / 5),
        ("N·m/rad²", "N/m²", 2 / 5**2),
        ("N·m·s/rad²", "N·s/m²", 2 / 3 / 5),
        ("kg·m²", "kg", 2 * 5 / 3**2),
        ("kg·m", "kg", 2),
        ("rad", "m", 5),
        ("rad/s", "m/s", 3),
        ("rad/s²", "m/s²", 3**2 / 5),
        ("1/rad²", "1/m²", 1 / 5**2),
        ("1/turn", "rad/m", 1 / 5),
        ("rad/m", "rad/m", 1),
        ("N/m", "N/m", 1),
        ("Hz", "Hz", 1),
        ("1/°C", "1/°C", 1),
    ],
)
def test_a_unit_of_any_factors_becomes_one_of_a_slide_and_scales_with_its_joint(
    unit, prismatic, ratio
):
    assert unit_at("prismatic", unit) == prismatic and unit_at("revolute", unit) == unit
    assert LARGER.of(unit) == pytest.approx(ratio, rel=1e-14)
    assert unit_at("prismatic", prismatic) == prismatic, "a unit of a slide is not converted again"


def test_an_inertia_is_the_torque_per_acceleration():
    assert unit_of("kg·m²")[1:] == unit_of("N·m·s²/rad")[1:]
