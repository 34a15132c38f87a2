"""A drive beside one whose answer is late is sent set-points in time, however late it is."""

import pytest

from tests.acquisition.simulated import Event
from tests.acquisition.test_invariants import no_drive_that_answers_is_told_nothing_for_long
from tests.acquisition.test_stopping import run_with


@pytest.mark.parametrize("late_s", [0.0199, 0.0203, 0.02063, 0.0209, 0.0213])
@pytest.mark.parametrize("at", [122, 123, 124, 125])
def test_time_runs_from_when_a_set_point_was_sent_not_from_its_answer(tmp_path, at, late_s):
    """Else the next one is due an answer's time later, just when the late answer has come and the
    loop asks all drives where they are: the set-point waits for that too."""
    run = run_with(tmp_path, Event(at, "late", late_s), Event(at + 2, "late", 0.005))
    no_drive_that_answers_is_told_nothing_for_long(run)
