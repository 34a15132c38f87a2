"""What an import leaves in its folder leads to a verdict, or it is said what is missing and how to
give it."""

import subprocess
import sys

import pandas as pd
import pytest

from exoid_cli.app import run
from tests.importing.conftest import MAP

BOTH = MAP.partition("[[recording]]")[0]
"""Without a word on recordings a map makes one to train and one to validate."""
EMPTY_TOML = "next to them, `exoid run` does the rest"


@pytest.fixture
def two_folders(pendulum, write_csv, tmp_path):
    """Two runs whose files have one name, in folders of their own, as loggers make them."""
    files = []
    for name, sign in (("run1", 1.0), ("run2", -1.0)):
        (tmp_path / name).mkdir()
        columns = pendulum.columns() | {
            what: sign * getattr(pendulum, what) for what in ("angle", "velocity", "torque")
        }
        files.append(write_csv(columns, f"{name}/log.csv"))
    return files


def test_files_of_one_name_are_distinguished_by_their_folders_as_the_refusal_says(
    imported, two_folders
):
    refused = imported(*two_folders, map_text=BOTH)
    assert refused.code == 2
    assert (
        'such as "{folder}_{file}_{purpose}", or each file one of its own, files = "run2/log.csv"'
        in refused.err
    )
    named = BOTH + "".join(
        f'[[recording]]\nname = "{{folder}}_{{file}}_{{purpose}}"\npurpose = "{purpose}"\nspan ='
        f" {span}\n"
        for purpose, span in (("train", [0.0, 0.7]), ("validate", [0.7, 1.0]))
    )
    assert imported(*two_folders, map_text=named).code == 0
    chosen = BOTH + "".join(
        f'[[recording]]\nname = "{purpose}"\npurpose = "{purpose}"\nfiles = "{folder}/log.csv"\n'
        for purpose, folder in (("train", "run1"), ("validate", "run?"))
    ).replace("run?", "run2")
    outcome = imported(*two_folders, map_text=chosen)
    assert (outcome.code, outcome.err.count("would replace")) == (0, 0)
    assert (
        outcome.recording("train").frame["pivot_angle_rad"][5]
        == -outcome.recording("validate").frame["pivot_angle_rad"][5]
    )


def test_a_file_that_is_given_twice_is_named_as_that(imported, pendulum, write_csv):
    path = write_csv(pendulum.columns())
    assert "give the file once" in imported(path, path).err


def test_a_guess_for_files_of_one_name_imports_both(imported, two_folders, tmp_path, capsys):
    assert (
        run(["import", *map(str, two_folders), "--guess", "--map", str(tmp_path / "guess.toml")])
        == 0
    )
    capsys.readouterr()
    outcome = imported(*two_folders, map_text=(tmp_path / "guess.toml").read_text(encoding="utf-8"))
    assert (outcome.code, outcome.err) == (0, "")
    assert [path.name for path in sorted(outcome.folder.iterdir())] == [
        "run1_log.parquet",
        "run2_log.parquet",
    ]


@pytest.mark.parametrize(
    ("has", "lacks", "what"), [("train", "validate", "judge on"), ("validate", "train", "fit to")]
)
def test_a_map_of_one_purpose_says_which_is_missing_and_how_to_give_it(
    imported, pendulum, write_csv, has, lacks, what
):
    path = write_csv(pendulum.columns())
    outcome = imported(path, map_text=MAP.replace('purpose = "train"', f'purpose = "{has}"'))
    assert f"`exoid run` lacks a recording to {what}: add a [[recording]] to" in outcome.printed
    assert f'with purpose = "{lacks}"' in outcome.printed
    assert EMPTY_TOML not in outcome.printed
    other = MAP.replace('purpose = "train"', f'purpose = "{lacks}"').replace("whole", "another")
    assert EMPTY_TOML in imported(path, map_text=other).printed


def test_a_recording_that_no_file_matches_is_reported(imported, pendulum, write_csv):
    text = MAP + '[[recording]]\npurpose = "validate"\nfiles = "lgo*.csv"\n'
    outcome = imported(write_csv(pendulum.columns()), map_text=text)
    assert outcome.code == 0
    assert 'recording[1] (validate): no given file matches "lgo*.csv"; left out' in outcome.err


def test_a_recording_that_a_changed_map_no_longer_makes_is_named_and_kept(
    imported, pendulum, write_csv
):
    path = write_csv(pendulum.columns())
    imported(path)
    outcome = imported(path, map_text=MAP.replace("whole", "all"))
    assert (
        "whole.parquet: made of these logs with an earlier map, but not with this one; remove it"
        in outcome.err
    )
    assert sorted(one.name for one in outcome.folder.iterdir()) == ["all.parquet", "whole.parquet"]
    other = write_csv(pendulum.columns() | {"torque": 2.0 * pendulum.torque}, "other.csv")
    assert imported(other, map_text=MAP.replace("whole", "other")).err == ""


def test_a_foreign_table_under_a_recordings_name_is_kept_and_named(
    imported, pendulum, write_csv, tmp_path
):
    path = tmp_path / "recordings" / "whole.parquet"
    path.parent.mkdir()
    pd.DataFrame({"t": [0.0]}).to_parquet(path)
    outcome = imported(write_csv(pendulum.columns()))
    assert (outcome.code, len(outcome.err.splitlines())) == (2, 1)
    assert (
        "whole.parquet: holds a table of another program, not overwritten with recording/1; choose"
        in outcome.err
    )
    assert list(pd.read_parquet(path)) == ["t"]


def test_what_a_killed_import_left_is_named(imported, pendulum, write_csv, tmp_path):
    temporary = tmp_path / "recordings" / ".abc.tmp"
    temporary.mkdir(parents=True)
    outcome = imported(write_csv(pendulum.columns()))
    message = f"{temporary}: temporary file of an import that was killed"
    assert (outcome.code, message in outcome.err) == (0, True)


def test_a_file_that_grows_too_large_is_named_with_what_to_do(pendulum, write_csv, tmp_path):
    resource = pytest.importorskip("resource", reason="Windows knows no such limit")
    path = write_csv(pendulum.columns())
    (tmp_path / "map.toml").write_text(MAP, encoding="utf-8")
    code = (
        f"import sys; from exoid_cli.app import run; sys.exit(run(['import', {str(path)!r},"
        " '--map', 'map.toml']))"
    )
    stopped = subprocess.run(
        [sys.executable, "-c", code],
        cwd=tmp_path,
        capture_output=True,
        text=True,
        timeout=120,
        preexec_fn=lambda: resource.setrlimit(resource.RLIMIT_FSIZE, (20_000, 20_000)),
    )
    assert stopped.returncode == 2
    assert stopped.stderr.endswith(
        f"{tmp_path / 'recordings' / 'whole.parquet'}: File too large; files may not be so large"
        " there; raise the limit (ulimit -f), or choose another place\n"
    )
    assert stopped.stderr.count("\n") == 1
    assert not (tmp_path / "recordings").exists()
