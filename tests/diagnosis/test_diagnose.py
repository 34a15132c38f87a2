"""Effects hidden in the plant's recordings are named, and faultless ones raise no alarm."""

from dataclasses import replace

import numpy as np
import pytest

from pipelines.contracts import CANDIDATES, PARAMETERS, RECORDING, RESIDUALS
from pipelines.diagnosis.diagnose import diagnose
from pipelines.diagnosis.verdict.candidate_table import candidates
from pipelines.diagnosis.verdict.verdict import verdict
from pipelines.errors import InputError
from tests.diagnosis.sessions import SLOW, diagnosed, recordings, session

pytestmark = pytest.mark.long


def labels(cause):
    """Return a cause and its ties."""
    return {(c["effect"], c["joint"]) for c in (cause, *cause["indistinguishable_from"])}


@pytest.fixture(scope="module")
def faultless():
    return diagnosed(seconds=40.0)


def test_where_nothing_is_hidden_nothing_is_missing(faultless):
    outcome = verdict(faultless)
    assert outcome["status"] == "nothing_missing"
    assert outcome["causes"] == []
    assert outcome["data_faults"] == []


def test_the_floor_is_the_noise_that_was_put_in(faultless):
    """Ripple of 0.6 and 0.4 N·m, correlated over 20 ms: what a mean over 25 ms leaves of it."""
    rho = np.exp(-1 / (200 * 0.02))
    mean = np.sqrt((5 + 2 * sum((5 - k) * rho**k for k in range(1, 5))) / 25)
    np.testing.assert_allclose(faultless.floor_rms, np.array([0.6, 0.4]) * mean, rtol=0.06)


@pytest.mark.parametrize(
    ("effect", "joint", "values", "parameter"),
    [
        pytest.param(
            "stribeck_friction",
            "knee",
            {"stribeck_torque": 2.0, "stribeck_velocity": 0.15},
            "stribeck_torque",
            marks=pytest.mark.slow,
        ),
        pytest.param(
            "load_dependent_friction",
            "hip",
            {"load_coefficient": 0.06},
            "load_coefficient",
            marks=pytest.mark.slow,
        ),
        ("cogging", "knee", {"amplitude": 1.0, "cycles_per_turn": 24.0, "phase": 0.3}, "amplitude"),
        pytest.param(
            "mass_off_axis", "knee", {"mass_moment": 0.15}, "mass_moment", marks=pytest.mark.slow
        ),
        pytest.param("torque_gain", "hip", {"gain": 1.08}, "gain", marks=pytest.mark.slow),
        pytest.param(
            "voluntary_torque",
            "hip",
            {"amplitude": 2.2, "frequency": 0.43, "phase": 0.4},
            "frequency",
            marks=pytest.mark.slow,
        ),
    ],
)
def test_a_hidden_effect_is_named_with_its_size_and_the_error_falls_to_the_floor(
    effect, joint, values, parameter
):
    diagnosis = diagnosed(effect, joint, seed=3, **values)
    outcome = verdict(diagnosis)
    assert outcome["status"] == "explained"
    first = outcome["causes"][0]
    assert (effect, joint) in labels(first)
    assert first["probability"] > 0.5
    size = next(p for p in first["parameters"] if p["name"] == parameter)
    assert size["value"] == pytest.approx(values[parameter], rel=0.15)
    np.testing.assert_allclose(diagnosis.after.errors.rms, diagnosis.floor_rms, rtol=0.08)
    assert first["gain"]["ci95"][0] > 0
    assert diagnosis.unrealizable == []
    # A peak of friction and its level are separated by how it falls with speed alone; the others
    # stand for themselves.
    assert ["knee coulomb" in sentence for sentence in diagnosis.collinear] == [True] * (
        effect == "stribeck_friction"
    )


@pytest.mark.slow
def test_a_drag_that_slow_training_hardly_shows_is_found_among_laws_of_its_joints_speed():
    drag = dict(seed=3, seconds=40.0, trained=SLOW, drag=28.0)
    diagnosis = diagnose(session("quadratic_drag", "hip", **drag))
    assert diagnosis.after.fit.rms[0] > 0.95 * diagnosis.before.fit.rms[0], (
        "it is a twentieth of the error at most"
    )
    (finding,) = diagnosis.selected.findings
    (speed,) = (p for level, value, p in finding.path if (level, value) == ("family", "speed"))
    assert (finding.joint, finding.family) == ("hip", "speed") and speed > 0.9
    assert "quadratic_drag@hip" in list(diagnosis.selected.posterior.marginals)[:3]


@pytest.mark.parametrize(
    ("effect", "joint", "values", "tied"),
    [
        ("torque_offset", "knee", {"offset": 1.0}, ("coulomb_asymmetry", "knee")),
        pytest.param(
            "base_tilt", None, {"tilt": 0.04}, ("encoder_offset", "hip"), marks=pytest.mark.slow
        ),
    ],
)
def test_what_no_data_of_a_kind_can_part_is_said_to_be_one_or_the_other(
    effect, joint, values, tied
):
    first = verdict(diagnosed(effect, joint, seed=5, **values))["causes"][0]
    assert {(effect, joint), tied} <= labels(first)
    for tie in first["indistinguishable_from"]:
        assert tie["why"]
        assert tie["how_to_separate"]


def test_a_torque_that_no_cause_explains_is_called_unknown():
    """A knee torque in proportion to the product of both speeds, in no catalogue."""
    odd = []
    for m in [m for m in session(seed=7) if m.run == "exo_alone"]:
        extra = np.zeros_like(m.torque)
        extra[:, 1] = 6.0 * np.sin(9.0 * m.q[:, 0]) * m.dq[:, 0]
        odd.append(replace(m, torque=m.torque + extra))
    outcome = verdict(diagnose(odd))
    assert outcome["status"] in ("unknown_cause", "partly_explained")
    assert outcome["unexplained"]["knee"] > 0.2


def test_a_fault_of_acquisition_is_named_before_any_physics():
    motions = session(seed=8)
    flipped = [replace(m, torque=m.torque * [1.0, -1.0]) for m in motions]
    outcome = verdict(diagnose(flipped))
    assert outcome["data_faults"]
    assert outcome["causes"] == []
    assert outcome["acquisition_at_fault"]
    assert outcome["summary"].startswith("Acquisition, not physics")


def test_the_tables_keep_their_contracts(faultless):
    meta = {"geometry": {}, "covariance": faultless.covariance.tolist()}
    PARAMETERS.check(faultless.parameters, meta)
    RESIDUALS.check(faultless.residuals, {})
    CANDIDATES.check(candidates(faultless), {})


def test_without_a_run_to_validate_on_no_gain_can_be_measured():
    with pytest.raises(InputError, match="found no run to validate on among: run_0"):
        diagnose([m for m in session(seconds=40.0) if m.purpose == "train"])


def test_the_command_writes_verdict_and_tables(tmp_path, capsys):
    from exoid_cli.app import run

    files = []
    for number, table in enumerate(
        recordings("parallel_spring", "knee", seed=4, stiffness=6.0, rest_angle=-0.5)[:2]
    ):
        files.append(tmp_path / f"run_{number}.parquet")
        RECORDING.write(files[-1], table.frame, table.metadata)
    assert run(["diagnose", *map(str, files), "--out", str(tmp_path / "d")]) == 0
    out = " ".join(capsys.readouterr().out.split())
    assert "parallel spring at the knee" in out
    assert (
        "tracking error and peak torque under adaptive control, without and with the causes" in out
    )
    for name in (
        "verdict.json",
        "parameters.parquet",
        "residuals.parquet",
        "candidates.parquet",
        "detectability.json",
    ):
        assert (tmp_path / "d" / name).is_file()
    assert (
        PARAMETERS.read(tmp_path / "d" / "parameters.parquet").frame["step"] == "extension"
    ).any()
