import json
from typing import get_args

import numpy as np
import pandas as pd
import pyarrow as pa
import pyarrow.parquet as pq
import pytest

from pipelines.contracts import MOTION, PARAMETERS, RECORDING, RESIDUALS
from pipelines.estimation.estimators import ESTIMATORS
from pipelines.mechanics.fourier import FourierTrajectory
from pipelines.rig.plant import Plant
from pipelines.rig.record import record
from pipelines.settings.identify import Method
from pipelines.settings.rig.plant import PlantSettings

RICH = FourierTrajectory(
    theta0=np.array([0.65, -0.93]),
    a=np.array([[0.22, -0.16, 0.10], [0.12, 0.24, -0.11]]),
    b=np.array([[0.10, 0.12, -0.07], [-0.22, 0.08, 0.10]]),
    omega=0.2 * np.pi,
)


@pytest.fixture(scope="module")
def recordings(tmp_path_factory):
    folder = tmp_path_factory.mktemp("recordings")
    for run in ("exo_alone", "with_human"):
        for seed, purpose in enumerate(("train", "validate")):
            frame, metadata = record(Plant(PlantSettings(), run, seed=seed), RICH, 20.0, purpose)
            RECORDING.write(folder / f"{run}_{purpose}.parquet", frame, metadata)
    return folder


def test_filter_then_identify_as_a_user_would(exoid, recordings, tmp_path):
    motions = []
    for file in sorted(recordings.iterdir()):
        motion = tmp_path / file.name
        outcome = exoid("filter", file, "-o", motion)
        assert outcome.code == 0, outcome.err
        assert "cut-off" in outcome.out
        motions.append(motion)
    outcome = exoid("identify", *motions, "-o", tmp_path / "identified")
    assert outcome.code == 0, outcome.err
    assert "X1 with_human" in outcome.out
    parameters = PARAMETERS.read(tmp_path / "identified" / "parameters.parquet")
    assert len(parameters.frame) == 16
    assert np.array(parameters.metadata["covariance"]).shape == (16, 16)
    assert [entry["name"] for entry in parameters.metadata["inputs"]] == [m.name for m in motions]
    residuals = RESIDUALS.read(tmp_path / "identified" / "residuals.parquet").frame
    rest = residuals["hip_torque_nm"] - residuals["hip_predicted_nm"]
    np.testing.assert_allclose(residuals["hip_residual_nm"], rest, atol=1e-9)
    assert sorted(p.suffix for p in (tmp_path / "identified").glob("torque-*")) == [
        ".pdf",
        ".pdf",
        ".png",
        ".png",
    ]


def test_recordings_need_no_filter_command_and_no_settings(exoid, recordings, tmp_path):
    outcome = exoid("identify", *sorted(recordings.iterdir()), "-o", tmp_path, "--json")
    assert outcome.code == 0, outcome.err
    # NaN is no JSON, though Python reads it.
    printed = json.loads(outcome.out, parse_constant=pytest.fail)
    assert {"hip", "knee"} == set(printed["validation"]["all"])
    assert {row["joint"] for row in printed["parameters"]} == {"hip", "knee", None}


@pytest.mark.parametrize(
    "method", ["iteratively_reweighted", "instrumental_variables", "realizable"]
)
def test_a_method_gives_the_same_table_and_says_how_it_was_made(
    exoid, recordings, tmp_path, method
):
    (tmp_path / "exoid.toml").write_text("[identify]\nfigures = false\n")
    given = ("-o", tmp_path, "--config", tmp_path / "exoid.toml", "--method", method)
    outcome = exoid("identify", *sorted(recordings.iterdir()), *given)
    assert outcome.code == 0, outcome.err
    result = PARAMETERS.read(tmp_path / "parameters.parquet")
    assert len(result.frame) == 16
    assert result.metadata["method"]["estimator"] == method
    assert set(result.metadata["method"]["steps"]) == {"exo_alone", "with_human"}
    assert result.metadata["config"]["identify"]["method"] == method
    printed = "Durbin-Wu-Hausman" in outcome.out
    assert printed == (method == "instrumental_variables")


def test_the_method_can_stand_in_the_settings(exoid, recordings, tmp_path):
    (tmp_path / "exoid.toml").write_text(
        '[identify]\nmethod = "ordinary_least_squares"\nfigures = false\n'
    )
    given = [
        "identify",
        *sorted(recordings.iterdir()),
        "-o",
        tmp_path / "out",
        "--config",
        tmp_path / "exoid.toml",
    ]
    assert exoid(*given).code == 0
    result = PARAMETERS.read(tmp_path / "out" / "parameters.parquet")
    assert result.metadata["method"]["name"] == "two-step ordinary least squares"


def test_a_method_that_does_not_exist_ends_in_one_line_with_the_nearest(
    exoid, recordings, tmp_path
):
    outcome = exoid(
        "identify", *sorted(recordings.iterdir()), "-o", tmp_path / "out", "--method", "realisable"
    )
    assert outcome.code == 2
    assert outcome.err.count("\n") == 1
    assert "--method: there is no method 'realisable'; did you mean realizable?" in outcome.err
    assert not (tmp_path / "out").exists()


def test_instruments_without_set_points_end_in_one_line_that_names_the_file(
    exoid, recordings, tmp_path
):
    (tmp_path / "runs").mkdir()
    for file in recordings.iterdir():
        table = RECORDING.read(file)
        frame = table.frame.drop(columns=["hip_reference_rad", "knee_reference_rad"])
        RECORDING.write(tmp_path / "runs" / file.name, frame, table.metadata)
    files = sorted((tmp_path / "runs").iterdir())
    outcome = exoid(
        "identify", *files, "-o", tmp_path / "out", "--method", "instrumental_variables"
    )
    assert outcome.code == 2
    assert outcome.err.count("\n") == 1
    assert "exo_alone_train.parquet: has no set-points of the hip, which" in outcome.err
    assert not (tmp_path / "out").exists()


def test_the_settings_know_every_method():
    assert get_args(Method) == tuple(estimator.name for estimator in ESTIMATORS)


def test_output_fits_eighty_columns(exoid, recordings, tmp_path):
    (tmp_path / "exoid.toml").write_text("[identify]\nfigures = false\n")
    given = ("-o", tmp_path, "--config", tmp_path / "exoid.toml")
    outcome = exoid("identify", *sorted(recordings.iterdir()), *given)
    assert max(map(len, outcome.out.splitlines())) <= 80


def broken(recordings, tmp_path, change):
    """Write a recording's table past the contract, as a careless tool would."""
    source = recordings / "exo_alone_train.parquet"
    table = pq.read_table(source)
    frame = change(table.to_pandas())
    import pyarrow as pa

    target = tmp_path / "broken.parquet"
    pq.write_table(
        pa.Table.from_pandas(frame).replace_schema_metadata(table.schema.metadata), target
    )
    return target


def with_nan(frame):
    frame.loc[17, "hip_angle_rad"] = np.nan
    return frame


def backwards(frame):
    frame.loc[23, "time_s"] = frame.loc[20, "time_s"]
    return frame


def in_degrees(frame):
    return frame.assign(hip_angle_rad=np.rad2deg(frame["hip_angle_rad"]))


@pytest.mark.parametrize(
    ("change", "words"),
    [
        (with_nan, ["column hip_angle_rad", "row 17"]),
        (backwards, ["column time_s", "row 23"]),
        (in_degrees, ["column hip_angle_rad", "degrees"]),
        (lambda frame: frame.drop(columns="knee_torque_nm"), ["column knee_torque_nm is missing"]),
        (
            lambda frame: frame.rename(columns={"knee_torque_nm": "knee_torqe_nm"}),
            ["column knee_torque_nm is missing", "if knee_torqe_nm is meant to be it, rename it"],
        ),
    ],
)
@pytest.mark.parametrize("command", ["filter", "identify"])
def test_a_bad_recording_ends_in_one_line_and_no_file(
    exoid, recordings, tmp_path, command, change, words
):
    file = broken(recordings, tmp_path, change)
    target = tmp_path / "out.parquet"
    outcome = exoid(command, file, "-o", target)
    assert outcome.code == 2
    assert outcome.err.count("\n") == 1
    for word in [str(file), *words]:
        assert word in outcome.err
    assert not target.exists()


@pytest.mark.parametrize(
    ("content", "words"),
    [(None, "no such file"), (b"", "empty"), (b"PAR1 half a file", "Parquet")],
    ids=["missing", "empty", "truncated"],
)
@pytest.mark.parametrize("command", ["filter", "identify"])
def test_what_is_no_parquet_file_ends_in_one_line(exoid, tmp_path, command, content, words):
    file = tmp_path / "run.parquet"
    if content is not None:
        file.write_bytes(content)
    outcome = exoid(command, file, "-o", tmp_path / "out.parquet")
    assert outcome.code == 2
    assert outcome.err.count("\n") == 1
    assert words in outcome.err


def test_parameters_are_no_motion(exoid, recordings, tmp_path):
    (tmp_path / "exoid.toml").write_text("[identify]\nfigures = false\n")
    given = ("-o", tmp_path, "--config", tmp_path / "exoid.toml")
    assert exoid("identify", *sorted(recordings.iterdir()), *given).code == 0
    outcome = exoid("identify", tmp_path / "parameters.parquet", "-o", tmp_path / "again")
    assert outcome.code == 2
    assert "holds parameters/1, expected motion/1" in outcome.err


def test_a_recording_is_not_overwritten_by_its_motion(exoid, recordings, tmp_path):
    file = tmp_path / "run.parquet"
    file.write_bytes((recordings / "exo_alone_train.parquet").read_bytes())
    outcome = exoid("filter", file, "-o", file)
    assert outcome.code == 2
    assert "holds recording/1, not overwritten with motion/1" in outcome.err
    assert RECORDING.read(file).metadata["run"] == "exo_alone"


def test_an_output_that_cannot_be_written_ends_in_one_line_that_names_it(
    exoid, recordings, tmp_path
):
    recording = recordings / "exo_alone_train.parquet"
    (tmp_path / "file").write_text("in the way")
    (tmp_path / "folder" / recording.name).mkdir(parents=True)
    inside = tmp_path / "file" / "motion.parquet"
    for output, words in {
        tmp_path / "folder": "is a folder",
        inside: "a file stands where a folder should",
    }.items():
        outcome = exoid("filter", recording, "-o", output)
        assert outcome.code == 2
        assert outcome.err.count("\n") == 1
        assert f"{tmp_path}" in outcome.err
        assert words in outcome.err
    assert sorted(path.name for path in tmp_path.iterdir()) == ["file", "folder"]


def test_several_recordings_are_filtered_into_a_folder(exoid, recordings, tmp_path):
    files = sorted(recordings.iterdir())
    outcome = exoid("filter", *files, "-o", tmp_path / "motions", "--json")
    assert outcome.code == 0, outcome.err
    assert [one["file"] for one in json.loads(outcome.out)] == [
        str(tmp_path / "motions" / f.name) for f in files
    ]
    twice = exoid("filter", files[0], files[0], "-o", tmp_path / "motions")
    assert (twice.code, twice.err.count("\n")) == (2, 1)
    assert "two files are named exo_alone_train.parquet" in twice.err


def test_settings_that_are_not_there_end_in_one_line(exoid, recordings, tmp_path):
    outcome = exoid(
        "filter",
        recordings / "exo_alone_train.parquet",
        "-o",
        tmp_path / "m",
        "--config",
        "none.toml",
    )
    assert (outcome.code, outcome.err.count("\n")) == (2, 1)
    assert "none.toml: no such file" in outcome.err
    assert list(tmp_path.iterdir()) == []


def test_one_run_only_and_no_empty_run_are_refused(exoid, recordings, tmp_path):
    alone = exoid("identify", recordings / "exo_alone_train.parquet", "-o", tmp_path)
    assert alone.code == 2
    assert "found no run to validate on" in alone.err
    human = exoid("identify", *sorted(recordings.glob("with_human*")), "-o", tmp_path)
    assert human.code == 2
    assert "found no exo_alone run to train on" in human.err


def test_the_same_run_twice_is_refused(exoid, recordings, tmp_path):
    copy = tmp_path / "copy.parquet"
    copy.write_bytes((recordings / "exo_alone_train.parquet").read_bytes())
    outcome = exoid("identify", recordings / "exo_alone_train.parquet", copy, "-o", tmp_path / "i")
    assert outcome.code == 2
    assert "holds the same data as" in outcome.err


@pytest.mark.parametrize(
    ("content", "printed"),
    [(b"", "is empty (0 bytes)"), (b"no Parquet" * 9, "is not a Parquet file")],
)
def test_files_that_are_alike_since_they_hold_nothing_are_not_called_copies(
    exoid, tmp_path, content, printed
):
    for name in ("one.parquet", "two.parquet"):
        (tmp_path / name).write_bytes(content)
    outcome = exoid(
        "diagnose", tmp_path / "one.parquet", tmp_path / "two.parquet", "-o", tmp_path / "d"
    )
    assert (outcome.code, outcome.err.count("\n")) == (2, 1)
    assert printed in outcome.err and "same data" not in outcome.err


def test_a_diagnosis_that_is_refused_leaves_no_folder(exoid, recordings, tmp_path):
    outcome = exoid(
        "diagnose", recordings / "exo_alone_train.parquet", "-o", tmp_path / "new" / "diagnosed"
    )
    assert outcome.code == 2
    assert not (tmp_path / "new").exists()


def test_a_motion_says_its_filter(exoid, recordings, tmp_path):
    target = tmp_path / "m.parquet"
    exoid("filter", recordings / "exo_alone_train.parquet", "-o", target, "--cutoff-hz", "9")
    metadata = MOTION.read(target).metadata
    assert metadata["filter"]["cutoff_hz"] == 9.0
    assert metadata["filter"]["why"] == "set by hand"
    assert isinstance(MOTION.read(target).frame, pd.DataFrame)


def test_causes_of_a_diagnosis_are_fitted_with_their_shapes_held_next_to_the_fit_without(
    exoid, recordings, tmp_path
):
    """The rig's knee has an elastic transmission of 900 N·m/rad, says the file; its amplitudes are
    none."""
    quiet = tmp_path / "exoid.toml"
    quiet.write_text("[identify]\nfigures = false\n")
    files, given = sorted(recordings.iterdir()), ("--config", quiet)
    assert exoid("identify", *files, "-o", tmp_path / "plain", *given).code == 0
    plain = PARAMETERS.read(tmp_path / "plain" / "parameters.parquet")
    elastic = plain.frame.iloc[[0]].assign(
        name="stiffness",
        symbol="k",
        joint="knee",
        run=None,
        value=900.0,
        unit="N·m/rad",
        std_error=40.0,
        ci95_low=820.0,
        ci95_high=980.0,
        step="extension",
        effect="joint_elasticity",
    )
    frame = pd.concat([plain.frame, elastic], ignore_index=True)
    metadata = {
        key: value for key, value in plain.metadata.items() if key not in ("covariance", "contract")
    }
    PARAMETERS.write(tmp_path / "named.parquet", frame, metadata)
    asked = ("--causes", tmp_path / "named.parquet", "--effect", "torque_offset@hip", *given)
    refused = exoid("identify", *files, *asked)
    assert refused.code == 2
    assert "--causes: no folder is given; name one with -o" in refused.err
    outcome = exoid("identify", *files, "-o", tmp_path / "refitted", *asked, "--json")
    assert outcome.code == 0, outcome.err
    rows = json.loads(outcome.out, parse_constant=pytest.fail)["parameters"]
    assert [(row["effect"], row["name"], row["step"]) for row in rows[16:]] == [
        ("joint_elasticity", "stiffness", "extension"),
        ("joint_elasticity", "hardening", "extension"),
        ("torque_offset", "offset", "extension"),
    ]
    assert rows[16]["std_error"] == pytest.approx(40.0)
    assert rows[17]["std_error"] is None
    result = PARAMETERS.read(tmp_path / "refitted" / "parameters.parquet")
    assert np.array(result.metadata["covariance"]).shape == (19, 19)
    assert result.metadata["inputs"][-1]["name"] == "named.parquet"
    assert set(RESIDUALS.read(tmp_path / "refitted" / "residuals.parquet").frame["model"]) == {
        "extended"
    }
    replayed = ("--replay", files[0], "-o", tmp_path / "replay.parquet")
    outcome = exoid("simulate", tmp_path / "refitted" / "parameters.parquet", *replayed)
    assert outcome.code == 0, outcome.err


def test_every_sample_can_be_asked_for_and_effects_by_their_names(exoid, recordings, tmp_path):
    (tmp_path / "exoid.toml").write_text("[identify]\nfigures = false\nreversals = true\n")
    asked = (
        *sorted(recordings.iterdir()),
        "--config",
        tmp_path / "exoid.toml",
        "--effect",
        "rotor_inertia@knee",
    )
    outcome = exoid("identify", *asked, "-o", tmp_path)
    assert outcome.code == 0, outcome.err
    assert "knee J" in outcome.out
    result = PARAMETERS.read(tmp_path / "parameters.parquet").metadata["method"]
    assert result["samples"] == "all"
    assert result["effects"] == ["rotor_inertia@knee"]
    outcome = exoid("identify", *asked)
    assert outcome.code == 2
    assert "--effect: no folder is given" in outcome.err


@pytest.mark.parametrize(
    ("damage", "printed"),
    [
        (
            lambda f: pd.concat([f, f.tail(1)], ignore_index=True),
            "row 17 repeats stiffness of joint_elasticity",
        ),
        (
            lambda f: f.assign(std_error=-0.1),
            "column std_error, row 0: found -0.1, expected 0 or more",
        ),
        (
            lambda f: f.assign(effect=f["effect"].replace("joint_elasticity", "joint_elastic")),
            "there is no effect",
        ),
    ],
)
def test_a_damaged_table_of_causes_is_refused_with_its_name(
    exoid, recordings, tmp_path, damage, printed
):
    files = sorted(recordings.iterdir())
    (tmp_path / "exoid.toml").write_text("[identify]\nfigures = false\n")
    given = ("--config", tmp_path / "exoid.toml")
    assert exoid("identify", *files, "-o", tmp_path / "plain", *given).code == 0
    plain = PARAMETERS.read(tmp_path / "plain" / "parameters.parquet")
    metadata = {
        key: value for key, value in plain.metadata.items() if key not in ("covariance", "contract")
    }
    elastic = plain.frame.iloc[[0]].assign(
        name="stiffness",
        joint="knee",
        run=None,
        value=900.0,
        effect="joint_elasticity",
        step="extension",
    )
    frame = damage(pd.concat([plain.frame, elastic], ignore_index=True))
    table = pa.Table.from_pandas(frame, preserve_index=False)
    about = {b"exoid": json.dumps(metadata | {"contract": "parameters/1"}).encode()}
    pq.write_table(table.replace_schema_metadata(about), tmp_path / "named.parquet")
    outcome = exoid(
        "identify", *files, "-o", tmp_path / "out", "--causes", tmp_path / "named.parquet", *given
    )
    assert outcome.code == 2
    assert f"{tmp_path / 'named.parquet'}" in outcome.err
    assert printed in outcome.err
    assert not (tmp_path / "out").exists()


def test_the_causes_own_folder_is_no_place_for_a_refit(exoid, recordings, tmp_path):
    files = sorted(recordings.iterdir())
    (tmp_path / "exoid.toml").write_text("[identify]\nfigures = false\n")
    given = ("--config", tmp_path / "exoid.toml")
    assert exoid("identify", *files, "-o", tmp_path / "plain", *given).code == 0
    causes = tmp_path / "plain" / "parameters.parquet"
    before = causes.read_bytes()
    outcome = exoid("identify", *files, "-o", tmp_path / "plain", "--causes", causes, *given)
    assert outcome.code == 2
    assert "would be overwritten" in outcome.err
    assert causes.read_bytes() == before
    (tmp_path / "plain" / "verdict.json").write_text("{}")
    outcome = exoid(
        "identify", *files, "-o", tmp_path / "plain", "--effect", "rotor_inertia@knee", *given
    )
    assert outcome.code == 2
    assert "holds a diagnosis" in outcome.err
    assert causes.read_bytes() == before


def test_runs_to_validate_on_are_of_a_kind_that_is_trained_on(exoid, recordings, tmp_path):
    outcome = exoid(
        "identify",
        recordings / "exo_alone_train.parquet",
        recordings / "with_human_validate.parquet",
        "-o",
        tmp_path,
    )
    assert outcome.code == 2
    assert "found no run to validate on of a kind that is trained on (exo_alone)" in outcome.err
