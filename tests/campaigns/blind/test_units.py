"""Every parameter of every cause has a unit that is known."""

import numpy as np
import pytest

from tests.campaigns.blind.cases import CAUSES
from tests.campaigns.blind.causes import FORMS, joints_of
from tests.campaigns.blind.units import POWERS, Units

SIZE = 0.1


def parameters_by(effect):
    """Return the names of the parameters of a cause's forms."""
    rng = np.random.default_rng(900_000)
    drawn = [form(rng, joint) for form in FORMS[effect] for joint in joints_of(effect)]
    return {name for cause in drawn for name in cause.parameters(SIZE)}


def test_the_table_has_the_parameters_of_causes_and_nothing_else():
    drawn = {(effect, name) for effect in CAUSES for name in parameters_by(effect)}
    assert drawn == set(POWERS), "units.py has the unit of each parameter"


def test_play_of_a_slide_is_a_length():
    assert Units(torque=50.0, angle=0.2).converted("backlash", {"play": 0.03}) == {
        "play": pytest.approx(0.006)
    }


def test_a_parameter_of_unknown_unit_is_refused():
    with pytest.raises(KeyError):
        Units().converted("backlash", {"slack": 0.03})
