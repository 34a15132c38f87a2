"""A cause pays for its forms, for a shape off the usual, and for what was sought among many
values."""

import numpy as np
import pytest

from pipelines.diagnosis.candidates.candidate import NEVER, Candidate
from pipelines.diagnosis.candidates.shape_refinement import ONSETS, log_searched, reach
from pipelines.effects import Cogging
from pipelines.effects.backlash import Backlash
from pipelines.effects.encoder_offset import EncoderOffset
from pipelines.effects.end_stop import EndStop
from pipelines.effects.mass_off_axis import MassOffAxis
from pipelines.effects.payload_change import PayloadChange
from pipelines.effects.time_delay import TimeDelay


def test_of_six_forms_each_has_a_sixth_of_the_prior():
    assert Candidate(EndStop("knee"), ((0.4, 1.0, 1.5),)).log_prior == pytest.approx(-np.log(6.0))
    assert Candidate(MassOffAxis("knee"), ((),)).log_prior == 0.0


def test_a_shape_has_students_distribution_about_the_middle_of_its_range_and_heavy_tails():
    low, high = Backlash("knee").shape[0].typical
    own = [
        Candidate(Backlash("knee"), ((play,),)).log_prior
        for play in (np.sqrt(low * high), low, high, 4.0 * high)
    ]
    middle, *ends, beyond = own
    assert ends == pytest.approx([middle - 2.0 * np.log(7.0 / 3.0)] * 2)
    assert middle - 4.0 < beyond < ends[0] - 1.0
    # It is a density: over a range that holds nearly all it integrates to one, in units of the
    # typical range.
    plays = np.exp(np.linspace(np.log(low) - 30.0, np.log(high) + 30.0, 20001))
    densities = np.exp([Candidate(Backlash("knee"), ((play,),)).log_prior for play in plays])
    forms = len(Backlash("knee").shape[1].forms)
    assert forms * np.trapezoid(densities, np.log(plays)) / np.log(high / low) == pytest.approx(
        1.0, abs=1e-3
    )


def test_waves_and_onsets_were_sought_among_many_values_and_an_onset_that_never_came_among_none():
    assert log_searched(Candidate(Cogging("knee"), ((24.0,),))) == pytest.approx(np.log(396.0))
    both, one = (
        Candidate(PayloadChange("knee"), ((20.0, 0.3), (late, 0.3))) for late in (30.0, NEVER)
    )
    assert log_searched(both) == pytest.approx(2.0 * np.log(ONSETS))
    assert log_searched(one) == pytest.approx(np.log(ONSETS))
    assert log_searched(Candidate(Backlash("knee"), ((0.01,),))) == 0.0


def test_a_torque_channel_is_never_early():
    """A shape that is typically zero or more is refined down to zero, one of either sign beyond its
    range."""
    assert reach(TimeDelay("knee").shape[0])[0] == 0.0
    low, high = EncoderOffset("knee").shape[0].typical
    assert reach(EncoderOffset("knee").shape[0]) == pytest.approx(
        (1.5 * low - 0.5 * high, 1.5 * high - 0.5 * low)
    )
