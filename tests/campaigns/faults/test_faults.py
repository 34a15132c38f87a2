"""No fault brings a wrong number into a recording: a run goes on with a stated gap, or stops
and says why."""

import re

import pytest

from tests.campaigns.faults.faults import WATCHDOG_S, cases
from tests.campaigns.faults.proxy import RtuFrame, TcpFrame
from tests.campaigns.faults.runs import RATE, run_through

pytestmark = pytest.mark.long


def silence_s(why):
    """Return for how long, by its reason, a run got no credible answer."""
    match = re.search(r"for (\d+\.\d+) s", why or "")
    return float(match[1]) if match else 0.0


EVERY_CASE = pytest.mark.parametrize(
    ("frames", "case"),
    [
        # What serial lines alone have, and each sixth of the others; all of them in `make faults`
        # and `make test-slow`.
        pytest.param(
            frames,
            case,
            id=f"{name}: {case.name}",
            marks=pytest.mark.slow
            if frames is RtuFrame and case.frames is not RtuFrame and k % 6
            else (),
        )
        for frames, name in ((TcpFrame, "TCP"), (RtuFrame, "RTU"))
        for k, case in enumerate(cases(frames))
    ],
)


@EVERY_CASE
def test_a_fault_leaves_a_stated_gap_or_stops_the_run_with_its_reason(frames, case, tmp_path):
    result = run_through(case.fault, tmp_path, case.run, frames=frames)
    # That is known only when others have moved on.
    assert result.wrong == 0 or "frozen" in str(result.why)
    assert result.wrong_s <= silence_s(result.why)
    assert result.disabled or "could not be disabled" in str(result.why)
    between = (
        int(result.frame["sequence"].iloc[-1] - result.frame["sequence"].iloc[0])
        + 1
        - len(result.frame)
    )
    # A busy computer may miss the last sample of a complete run, which no later sample shows.
    assert between == result.missing or (result.why is None and between < result.missing)
    if case.stops is None or (case.either and result.why is None):
        assert result.why is None
        assert len(result.frame) + result.missing == RATE
        assert result.missing > 0 or not case.gap  # a busy computer may miss a reply of its own
        assert result.missing <= WATCHDOG_S * RATE
    else:
        assert case.stops in str(result.why)
        assert "\n" not in str(result.why)
        assert case.stops in result.metadata["abort"]
        assert len(result.frame) >= 10  # all that came before the fault
