"""Machines with little evidence: named causes predict data that no fit has seen, and no travel is
reported."""

import pytest

from pipelines.diagnosis.data_faults import find_faults
from pipelines.mechanics.scale import on_one_scale
from tests.campaigns.real.machines import LOGS, diagnosed, motions, recordings

WEAK = pytest.mark.xfail(
    strict=True, reason="Stribeck friction is named too, and removes a fifth of the error"
)


@pytest.mark.parametrize(
    ("machine", "status"),
    [
        ("simple", "nothing_missing"),
        pytest.param("xl330", "partly_explained", marks=pytest.mark.slow),
        pytest.param("modexo", "partly_explained", marks=[WEAK, pytest.mark.slow]),
    ],
)
def test_of_small_or_dirty_logs_only_what_predicts_unseen_data_is_named(
    real_data, tmp_path, machine, status
):
    outcome = diagnosed(LOGS[machine], real_data, tmp_path).verdict
    assert (outcome["status"], outcome["reversals"]) == (status, [])
    assert all(cause["gain"]["systematic_error_removed"] > 0.25 for cause in outcome["causes"])


@pytest.mark.parametrize("machine", ["simple", "xl330", "modexo"])
def test_no_sign_of_a_machine_that_was_wired_rightly_is_reported_as_reversed(
    real_data, tmp_path, machine
):
    runs = on_one_scale(motions(recordings(LOGS[machine], real_data, tmp_path)))
    assert not [fault.what for fault in find_faults(runs) if "sign" in fault.what]
