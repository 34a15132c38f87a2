"""A verdict with a hole is refused before anything is computed with it, in words that name the hole."""

import json
from copy import deepcopy

import pytest

from pipelines.contracts import verdict
from pipelines.errors import ContractError
from tests.report.sessions import AXIS, LEG, verdict_of

NAN = float("nan")
HOLES = {
    "baseline_rmse_nm.knee": lambda said: said["baseline_rmse_nm"].update(knee=None),
    "extended_rmse_unmasked_nm.hip": lambda said: said["extended_rmse_unmasked_nm"].update(hip="0.3"),
    "noise_floor_nm.hip": lambda said: said["noise_floor_nm"].update(hip=0.0),
    "causes": lambda said: said.update(causes="x"),
    "causes[0].gain.ci95[1]": lambda said: said["causes"][0]["gain"].update(ci95=[0.1, NAN]),
    "causes[0].gain.joint": lambda said: said["causes"][0]["gain"].update(joint="ankle"),
    "control.with.peak_torque_nm.hip": lambda said: said["control"]["with"]["peak_torque_nm"].update(hip=NAN),
    "error_budget.hip.noise_floor": lambda said: said["error_budget"]["hip"].update(noise_floor=None),
    "unexplained": lambda said: said["unexplained"].pop("hip"),
    "units": lambda said: said.update(units={}),
    "torque_rms_nm": lambda said: said.update(torque_rms_nm={"knee": 12.0}),
}


@pytest.mark.parametrize("joints", [LEG, AXIS])
def test_a_whole_verdict_is_read_as_it_stands(tmp_path, joints):
    path = tmp_path / "verdict.json"
    path.write_text(json.dumps(verdict_of(joints)))
    assert verdict.read(path) == verdict_of(joints)


@pytest.mark.parametrize("key", HOLES)
def test_a_hole_is_named_by_its_key(key):
    said = {k: deepcopy(value) for k, value in verdict_of().items()}  # no two of its tables are one object then
    HOLES[key](said)
    with pytest.raises(ContractError) as refusal:
        verdict.check(said, "verdict.json")
    assert str(refusal.value).startswith("verdict.json: ")
    assert key in str(refusal.value)


@pytest.mark.parametrize("key", [key for key in verdict_of() if key != "contract"])
def test_no_key_may_be_left_out(key):
    said = verdict_of()
    del said[key]
    with pytest.raises(ContractError, match=f"^here: {key}: missing; add it"):
        verdict.check(said, "here")
