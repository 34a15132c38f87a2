"""Machines that say little: their verdicts make no more of friction at reversals than of all else."""

import pytest

from tests.real.machines import LOGS, diagnosed


@pytest.mark.parametrize("machine", ["simple", "xl330", "modexo"])
def test_reversals_of_small_or_dirty_logs_show_no_travel(real_data, tmp_path, machine):
    assert diagnosed(LOGS[machine], real_data, tmp_path).verdict["reversals"] == []
