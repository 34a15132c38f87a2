"""A verdict with a hole is refused before anything is computed with it, in words that name the
hole."""

import json
from copy import deepcopy

import pytest

from pipelines.contracts import verdict
from pipelines.errors import ContractError
from tests.report.sessions import AXIS, LEG, decision_of, verdict_of

NAN = float("nan")
HOLES = {
    "baseline_rmse_nm.knee": lambda document: document["baseline_rmse_nm"].update(knee=None),
    "extended_rmse_unmasked_nm.hip": lambda document: document["extended_rmse_unmasked_nm"].update(
        hip="0.3"
    ),
    "noise_floor_nm.hip": lambda document: document["noise_floor_nm"].update(hip=0.0),
    "causes": lambda document: document.update(causes="x"),
    "causes[0].gain.ci95[1]": lambda document: document["causes"][0]["gain"].update(
        ci95=[0.1, NAN]
    ),
    "causes[0].gain.joint": lambda document: document["causes"][0]["gain"].update(joint="ankle"),
    "control.with.peak_torque_nm.hip": lambda document: document["control"]["with"][
        "peak_torque_nm"
    ].update(hip=NAN),
    "error_budget.hip.noise_floor": lambda document: document["error_budget"]["hip"].update(
        noise_floor=None
    ),
    "unexplained": lambda document: document["unexplained"].pop("hip"),
    "units": lambda document: document.update(units={}),
    "torque_rms_nm": lambda document: document.update(torque_rms_nm={"knee": 12.0}),
    "findings[0].joint": lambda document: document["findings"][0].update(joint="ankle"),
    "findings[0].path[1].probability": lambda document: document["findings"][0]["path"][1].update(
        probability=NAN
    ),
    "findings[0].causes[1].words": lambda document: document["findings"][0]["causes"][1].pop(
        "words"
    ),
    "findings[0].level": lambda document: document["findings"][0].update(level="guess"),
    "posterior.unlisted": lambda document: document["posterior"].update(unlisted=1.2),
    "posterior.causes.cogging@knee": lambda document: document["posterior"]["causes"].update(
        {"cogging@knee": "0.9"}
    ),
    "router": lambda document: document["router"].pop("hip"),
    "router.knee.noise": lambda document: document["router"]["knee"].update(noise=None),
}


def lines_of(joint):
    """Return the key of what detection lines show at one joint."""
    numbers = {"excited": 1.0, "odd": 0.2, "even": 0.1}
    keys = ("measured_nm", "predicted_nm", "residual_nm", "p_value")
    about = {"runs": 4, "periods": 8, "highest_hz": 12.5, "noise_nm": 0.3}
    return {"detection_lines": {joint: about | dict.fromkeys(keys, numbers)}}


def test_a_verdict_may_have_detection_lines_of_its_joints_alone():
    checked = verdict.check(verdict_of(**decision_of(), **lines_of("knee")), "new")
    assert checked.detection_lines["knee"].p_value.odd == 0.2
    assert verdict.check(verdict_of(), "older").detection_lines == {}
    with pytest.raises(ContractError, match=r"detection_lines\.ankle is 'ankle', no joint"):
        verdict.check(verdict_of(**decision_of(), **lines_of("ankle")), "new")


@pytest.mark.parametrize("joints", [LEG, AXIS])
def test_a_whole_verdict_is_read_as_it_stands(tmp_path, joints):
    path = tmp_path / "verdict.json"
    whole = verdict_of(joints, **decision_of(joints))
    path.write_text(json.dumps(whole))
    assert verdict.read(path).model_dump(by_alias=True, exclude_unset=True) == whole


def test_a_verdict_of_an_older_version_has_no_findings_and_is_read():
    verdict.check(verdict_of(), "older")


def test_where_acquisition_is_at_fault_there_is_no_posterior():
    decision = decision_of() | {"findings": [], "posterior": None}
    verdict.check(verdict_of(acquisition_at_fault=True, causes=[], **decision), "faulty")


@pytest.mark.parametrize("key", HOLES)
def test_a_hole_is_named_by_its_key(key):
    whole = verdict_of(**decision_of())
    document = {
        k: deepcopy(value) for k, value in whole.items()
    }  # no two tables are one object then
    HOLES[key](document)
    with pytest.raises(ContractError) as refusal:
        verdict.check(document, "verdict.json")
    assert str(refusal.value).startswith("verdict.json: ")
    assert key in str(refusal.value)


@pytest.mark.parametrize("key", [key for key in verdict_of() if key != "contract"])
def test_no_key_may_be_left_out(key):
    document = verdict_of()
    del document[key]
    with pytest.raises(ContractError, match=f"^here: {key}: missing; add it"):
        verdict.check(document, "here")
