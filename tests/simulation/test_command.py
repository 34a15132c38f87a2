"""``exoid simulate``: files, figures, and what it says of input that cannot be simulated."""

import json

import numpy as np
import pytest

from exoid_cli.app import run
from pipelines.contracts import SIMULATION
from pipelines.contracts.provenance import sha256
from pipelines.effects import EncoderOffset
from pipelines.model import Term
from tests.effects.catalogue import TERMS

LIGHT = ((2.6, 0.63, 1.78, 5.7), (3.0, 4.0), (2.0, 3.0))
IMPOSSIBLE = ((2.6, 0.63, 4.0, 5.7), (3.0, 4.0), (2.0, 3.0))
CAUSES = {
    term.effect.name: term for term in TERMS if term.effect.name not in ("rigid_body", "friction")
}
FIGURES = ("tracking", "error", "torque", "kv-sweep")


@pytest.fixture
def exoid(capsys):
    def call(*arguments):
        code = run([str(argument) for argument in arguments])
        captured = capsys.readouterr()
        return code, captured.out, " ".join(captured.err.split())

    return call


@pytest.fixture
def quick(tmp_path):
    """An exoid.toml without figures and with a short sweep; lines may be added."""

    def write(*lines):
        path = tmp_path / "exoid.toml"
        path.write_text(
            "\n".join(["[simulate]", "figures = false", "sweep_nm_s_rad = [300.0]", *lines])
        )
        return path

    return write


def test_tracking_writes_the_loop_the_sweep_and_every_figure(exoid, parameters_file, tmp_path):
    code, out, err = exoid("simulate", parameters_file(), "-o", tmp_path / "out")
    assert (code, err) == (0, "")
    assert "hip" in out and "0.0103" in out and "0.0129" in out and "200.0" in out
    table = SIMULATION.read(tmp_path / "out" / "rbf.parquet")
    assert len(table.frame) == 10001
    assert np.allclose(
        table.frame["hip_error_rad"],
        table.frame["hip_reference_rad"] - table.frame["hip_angle_rad"],
    )
    about = table.metadata
    assert about["plant"]["effects"][0] == {
        "effect": "rigid_body",
        "X1": 10.3016,
        "X2": 3.0157,
        "X3": 2.2664,
        "X4": 5.5354,
    }
    assert about["controller"] == {"type": "rbf", "reference": "gait"}
    assert about["config"]["simulate"]["feedback_gain_nm_s_rad"] == 300.0 and about["seed"] == 0
    assert [made["name"] for made in about["inputs"]] == ["parameters.parquet"]
    assert (
        (tmp_path / "out" / "kv-sweep.csv")
        .read_text()
        .startswith("feedback_gain_nm_s_rad,hip_error_rad,")
    )
    for figure in FIGURES:
        assert (tmp_path / "out" / f"{figure}.png").read_bytes().startswith(b"\x89PNG")
        assert (tmp_path / "out" / f"{figure}.pdf").read_bytes().startswith(b"%PDF")


def test_tracking_can_be_read_by_a_program(exoid, parameters_file, quick, tmp_path):
    code, out, _ = exoid(
        "simulate", parameters_file(), "--config", quick(), "-o", tmp_path, "--json"
    )
    told = json.loads(out)
    assert code == 0 and told["largest_error_rad"]["hip"] == pytest.approx(0.010277, abs=1e-5)
    assert told["sweep"][0]["feedback_gain_nm_s_rad"] == 300.0


def test_a_reference_file_is_followed_instead_of_the_gait(exoid, parameters_file, quick, tmp_path):
    (tmp_path / "wave.toml").write_text(
        'unit = "rad"\nomega_rad_s = 3.0\ntheta0_rad = [0.2, -0.5]\na = [[0.2], [0.1]]\nb = [[0.0],'
        " [0.1]]\n"
    )
    reference = tmp_path / "wave.toml"
    assert (
        exoid(
            "simulate",
            parameters_file(),
            "--config",
            quick(),
            "--reference",
            reference,
            "-o",
            tmp_path,
        )[0]
        == 0
    )
    table = SIMULATION.read(tmp_path / "rbf.parquet")
    assert table.metadata["controller"]["reference"] == "wave.toml"
    expected = 0.2 + 0.2 * np.sin(3.0 * table.frame["time_s"])
    assert np.allclose(table.frame["hip_reference_rad"], expected)


def test_replay_of_the_true_model_stays_on_the_recording(
    exoid, parameters_file, recording_file, tmp_path
):
    made = tmp_path / "replay.parquet"
    code, out, err = exoid(
        "simulate", parameters_file(LIGHT), "--replay", recording_file(), "-o", made, "--json"
    )
    assert (code, err) == (0, "")
    told = json.loads(out)
    assert max(told["simulation_rmse_rad"].values()) < 1e-4
    assert max(told["closed_loop_rmse_rad"].values()) < 1e-3
    assert max(told["closed_loop_rmse_nm"].values()) < 0.5
    open_loop = SIMULATION.read(made)
    assert open_loop.metadata["simulation_rmse_rad"] == told["simulation_rmse_rad"]
    assert open_loop.frame["window"].nunique() == 19
    closed = SIMULATION.read(tmp_path / "replay-closed-loop.parquet").frame
    difference = closed["knee_torque_nm"] - closed["knee_torque_measured_nm"]
    assert np.sqrt(np.mean(difference[100:-100] ** 2)) < 0.1
    for figure in ("replay.png", "replay-closed-loop.png"):
        assert (tmp_path / figure).read_bytes().startswith(b"\x89PNG")


@pytest.mark.parametrize(
    ("changes", "told"),
    [
        ({"controller": None}, "its metadata names no controller of the hip"),
        (
            {"controller": {"hip": {"type": "impedance"}, "knee": {"type": "pd"}}},
            "the controller of its hip is of type impedance, and exoid simulates pd only",
        ),
        (
            {"controller": {"hip": {"type": "pd", "kp_nm_rad": 9.0}}},
            "the controller of its hip lacks kp_nm_rad or kd_nm_s_rad",
        ),
        ({"columns": ["hip_reference_rad"]}, "it holds no references"),
    ],
)
def test_replay_without_a_controller_skips_the_closed_loop_and_says_why(
    exoid, parameters_file, recording_file, quick, tmp_path, changes, told
):
    made, settings = tmp_path / "replay.parquet", quick()
    recording = recording_file(**changes)
    code, _, err = exoid(
        "simulate", parameters_file(LIGHT), "--config", settings, "--replay", recording, "-o", made
    )
    assert (code, err) == (0, f"warning: no closed loop for {recording}: {told}")
    assert made.exists() and not (tmp_path / "replay-closed-loop.parquet").exists()


def test_a_model_whose_replay_diverges_is_refused_and_nothing_is_written(
    exoid, parameters_file, recording_file, quick, tmp_path
):
    parameters = parameters_file(((0.9, 1e-4, 1e-4, 2.0), (3.0, 4.6), (2.0, -0.28)))
    made, recording = tmp_path / "replay.parquet", recording_file()
    code, _, err = exoid(
        "simulate", parameters, "--config", quick(), "--replay", recording, "-o", made
    )
    assert code == 2 and not made.exists()
    assert err.startswith(f"exoid: {recording}: its simulation with {parameters} diverges within")


@pytest.mark.parametrize(
    "cause",
    [
        pytest.param(cause, id=name, marks=pytest.mark.slow if number % 3 else ())
        for number, (name, cause) in enumerate(CAUSES.items())
    ],
)
def test_a_model_with_any_cause_is_simulated_and_replayed(
    exoid, parameters_file, recording_file, quick, tmp_path, cause
):
    parameters, config = (
        parameters_file(LIGHT, causes=[cause]),
        quick("duration_s = 2.0", "settled_after_s = 1.0"),
    )
    assert exoid("simulate", parameters, "--config", config, "-o", tmp_path)[0] == 0
    tracked = SIMULATION.read(tmp_path / "rbf.parquet")
    assert cause.effect.label in [told["effect"] for told in tracked.metadata["plant"]["effects"]]
    # An angle sensor that is off lets the loop follow what it reads.
    assert tracked.frame.filter(like="_error_rad")[1000:].abs().to_numpy().max() < 0.1
    made = tmp_path / "replay.parquet"
    code, out, _ = exoid(
        "simulate",
        parameters,
        "--config",
        config,
        "--replay",
        recording_file(),
        "-o",
        made,
        "--json",
    )
    assert code == 0
    # The recorded leg has no such cause: in its drives' loop the model is off, and stays beside it.
    assert 1e-6 < max(json.loads(out)["closed_loop_rmse_nm"].values()) < 10.0


def told_of(label, *runs):
    """What a parameters/1 table tells of runs: (path of the recording, values)."""
    return {
        label: [
            {"name": path.name, "sha256": sha256(path), "values": values} for path, values in runs
        ]
    }


ZEROED = Term(EncoderOffset("knee", each_run=True), np.array([0.1]))
"""As in the first run; in the recording at hand the knee's zero is right."""


def replayed(exoid, parameters, config, recording, made):
    code, out, err = exoid(
        "simulate", parameters, "--config", config, "--replay", recording, "-o", made, "--json"
    )
    assert code == 0
    effects = {one.pop("effect"): one for one in SIMULATION.read(made).metadata["plant"]["effects"]}
    return json.loads(out)["simulation_rmse_rad"]["knee"], effects, err


def test_a_run_that_the_diagnosis_has_seen_is_replayed_with_its_own_values(
    exoid, parameters_file, recording_file, quick, tmp_path
):
    recording, other = recording_file(), tmp_path / "first.parquet"
    other.write_bytes(b"another run")
    told = told_of("encoder_offset@knee", (other, {"offset": 0.1}), (recording, {"offset": 0.0}))
    parameters = parameters_file(LIGHT, causes=[ZEROED], each_run=told)
    strayed, effects, err = replayed(
        exoid, parameters, quick(), recording, tmp_path / "replay.parquet"
    )
    assert effects["encoder_offset@knee"] == {"offset": 0.0}
    assert (strayed < 1e-4, err) == (True, "")
    # Its motion is the same run, whatever it is called.
    motion = tmp_path / "renamed.parquet"
    assert exoid("filter", recording, "-o", motion)[0] == 0
    assert replayed(exoid, parameters, quick(), motion, tmp_path / "again.parquet") == (
        strayed,
        effects,
        "",
    )


def test_a_run_that_no_diagnosis_has_seen_is_replayed_with_the_first_one_s_values_and_that_is_said(
    exoid, parameters_file, recording_file, quick, tmp_path
):
    first = tmp_path / "elsewhere" / "recording.parquet"
    first.parent.mkdir()
    first.write_bytes(b"another run of the same name")
    parameters = parameters_file(
        LIGHT, causes=[ZEROED], each_run=told_of("encoder_offset@knee", (first, {"offset": 0.1}))
    )
    recording = recording_file()
    strayed, effects, err = replayed(
        exoid, parameters, quick(), recording, tmp_path / "replay.parquet"
    )
    assert effects["encoder_offset@knee"] == {"offset": 0.1} and strayed > 1e-3
    assert (
        err == f"warning: encoder_offset@knee: each run has its own offset, but {parameters} has"
        f" none for {recording}; that of recording.parquet, its first run, is used. The errors"
        " contain the difference"
    )


def test_what_never_came_in_a_run_is_not_there_when_it_is_replayed(
    exoid, parameters_file, recording_file, quick, tmp_path
):
    recording, payload = recording_file(), CAUSES["payload_change"]
    told = told_of(payload.effect.label, (recording, {"time": None}))
    strayed, effects, err = replayed(
        exoid,
        parameters_file(LIGHT, causes=[payload], each_run=told),
        quick(),
        recording,
        tmp_path / "replay.parquet",
    )
    assert payload.effect.label not in effects
    assert (strayed < 1e-4, err) == (True, "")


def test_a_model_that_tells_of_no_run_is_replayed_with_the_values_it_holds_and_that_is_said(
    exoid, parameters_file, recording_file, quick, tmp_path
):
    parameters, recording = (
        parameters_file(LIGHT, causes=[CAUSES["payload_change"]]),
        recording_file(),
    )
    _, _, err = replayed(exoid, parameters, quick(), recording, tmp_path / "replay.parquet")
    assert err.startswith(
        f"warning: payload_change@knee: each run has its own time, but {parameters} has none for"
        f" {recording}; that of its rows is used"
    )


def test_parameters_without_the_run_are_told_with_those_there_are(
    exoid, parameters_file, quick, tmp_path
):
    parameters = parameters_file(run="exo_alone")
    given = ("simulate", parameters, "--config", quick(), "-o", tmp_path / "out")
    code, _, err = exoid(*given, "--run", "with_human")
    assert (code, err) == (
        2,
        (
            f"exoid: {parameters}: holds no model of the run with_human, only of: exo_alone; choose"
            " one with --run"
        ),
    )
    assert not (tmp_path / "out").exists()
    assert exoid(*given)[0] == 0  # of the only one there is
    assert SIMULATION.read(tmp_path / "out" / "rbf.parquet").metadata["plant"]["run"] == "exo_alone"


def test_parameters_of_no_real_leg_are_refused_with_the_reason(
    exoid, parameters_file, quick, tmp_path
):
    code, _, err = exoid(
        "simulate", parameters_file(IMPOSSIBLE), "--config", quick(), "-o", tmp_path / "out"
    )
    assert (code, err) == (
        2,
        (
            "exoid: the with_human parameters are not those of a real leg: X2 (X1 - X2) = 1.241 is"
            " not above (L1 X3)² = 2.428 kg²·m⁴: the mass matrix is not positive definite. Its"
            " simulation diverges; identify again from motions that separate X1, X2 and X3 better,"
            " or choose another --run"
        ),
    )
    assert not (tmp_path / "out").exists()


def test_a_loop_that_runs_away_is_told_with_its_time_and_writes_nothing(
    exoid, parameters_file, quick, tmp_path
):
    wild = quick("disturbance_nm = 400.0", "disturbance_rad_s = 1.0")
    code, _, err = exoid("simulate", parameters_file(), "--config", wild, "-o", tmp_path / "out")
    assert code == 2
    assert err.startswith("exoid: the simulated knee ran past one full turn at t = ")
    assert err.endswith(
        "s: the loop is unstable, or the disturbance stronger than the drives; lower"
        " simulate.adaptation_gain or simulate.disturbance_nm, or shorten simulate.step_s"
    )
    assert not (tmp_path / "out").exists()


def test_a_recording_in_place_of_parameters_is_told(exoid, recording_file, tmp_path):
    recording = recording_file()
    code, _, err = exoid("simulate", recording, "-o", tmp_path / "out")
    assert (code, err) == (
        2,
        (
            f"exoid: {recording}: holds recording/1, expected parameters/1; `exoid identify` makes"
            " a parameters file"
        ),
    )


def test_parameters_in_place_of_a_recording_are_told(exoid, parameters_file, tmp_path):
    parameters = parameters_file()
    code, _, err = exoid(
        "simulate", parameters, "--replay", parameters, "-o", tmp_path / "r.parquet"
    )
    assert code == 2
    assert err.startswith(f"exoid: {parameters}: holds parameters/1, expected motion/1")


def test_reference_and_replay_exclude_each_other(exoid, parameters_file, recording_file, tmp_path):
    recording = recording_file()
    code, _, err = exoid(
        "simulate",
        parameters_file(),
        "--replay",
        recording,
        "--reference",
        recording,
        "-o",
        tmp_path / "r.parquet",
    )
    assert (code, err) == (
        2,
        (
            "exoid: --reference and --replay exclude each other: a replay follows its recording;"
            " drop one"
        ),
    )


def test_settling_after_the_end_is_told(exoid, parameters_file, quick, tmp_path):
    config = quick("duration_s = 3.0")
    code, _, err = exoid("simulate", parameters_file(), "--config", config, "-o", tmp_path / "out")
    assert (code, err) == (
        2,
        (
            f"exoid: {config}: simulate: settled_after_s: found 5, expected less than duration_s ="
            " 3; lengthen the simulation"
        ),
    )
