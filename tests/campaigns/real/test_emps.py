"""The published benchmark of a drive whose screw is worn: EMPS of Janot, Gautier and Brunot."""

from dataclasses import replace

import pytest

from pipelines.diagnosis.data_faults import find_faults
from pipelines.mechanics.scale import on_one_scale
from tests.campaigns.real.machines import (
    LOGS,
    diagnosed,
    motions,
    of_purpose,
    recordings,
    symmetric,
)
from tests.campaigns.real.published import EMPS, EMPS_ERRORS
from tests.campaigns.real.relative_error import decimated_error, fitted


@pytest.fixture(scope="module")
def runs(real_data, tmp_path_factory):
    return motions(recordings(LOGS["emps"], real_data, tmp_path_factory.mktemp("emps")))


@pytest.fixture(scope="module")
def diagnosis(real_data, tmp_path_factory):
    return diagnosed(LOGS["emps"], real_data, tmp_path_factory.mktemp("emps"))


def _errors(model, runs):
    (train,), (pulses,) = of_purpose(runs, "train"), of_purpose(runs, "validate")
    return [decimated_error(model, run).percent[0] for run in (train, pulses)]


@pytest.mark.parametrize("fit", ["command", "benchmark"])
def test_the_symmetric_model_is_the_published_one(diagnosis, fit):
    """All four parameters within 1 %, errors no larger than the authors': by exoid's blocks and
    their filter."""
    runs = diagnosis.motions
    (train,) = of_purpose(runs, "train")
    model = symmetric(diagnosis)[train.file]
    model = model if fit == "command" else fitted(model, train)
    values = dict(
        zip((p.symbol for _, p in model.linear_parameters), model.linear_values, strict=True)
    )
    assert values == pytest.approx(EMPS, rel=0.01)
    assert all(
        e <= asked for e, asked in zip(_errors(model, runs), EMPS_ERRORS["symmetric"], strict=True)
    )


@pytest.mark.parametrize("fit", ["command", "benchmark"])
def test_diagnose_names_the_worn_screw_and_what_it_names_reaches_the_published_error(
    diagnosis, fit
):
    assert ("viscous_asymmetry", "axis") in diagnosis.causes
    (train,) = of_purpose(diagnosis.motions, "train")
    causes = (
        diagnosis.identified()[train.file] if fit == "command" else fitted(diagnosis.model, train)
    )
    relative, crossed = _errors(causes, diagnosis.motions)
    assert relative <= EMPS_ERRORS["asymmetric"][0]
    assert crossed <= EMPS_ERRORS["asymmetric"][1]


def test_the_few_reversals_of_the_screw_which_are_all_alike_show_no_travel(diagnosis):
    assert diagnosis.verdict["reversals"] == []


def test_the_screws_force_is_reported_as_reversed_where_it_is_and_only_there(runs):
    assert find_faults(on_one_scale(runs)) == []
    faults = find_faults(on_one_scale([replace(run, torque=-run.torque) for run in runs]))
    assert [fault.file for fault in faults] == [run.file for run in runs]
    assert all("the sign of axis_force_n is reversed" in fault.what for fault in faults)
