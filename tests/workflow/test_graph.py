"""The experiment's graph of files: what a change re-runs, with stand-ins for the commands that take
minutes."""

import os
import shutil
import subprocess
import sys
from pathlib import Path

import pyarrow as pa
import pytest

from pipelines.contracts import parquet
from pipelines.errors import SettingsError
from pipelines.settings import Experiment, datasets
from pipelines.settings.template import create
from pipelines.workflow.graph import STAGES, graph

pytestmark = pytest.mark.long

# Settings are split by exoid itself; every other command only writes the file it was asked for.
STAND_IN = f"""#!/bin/sh
case "$1" in
  settings) exec {sys.executable} -m exoid_cli.app "$@" ;;
esac
echo "$@" >> "$LOG"
case "$*" in
  *simulated/extended*) [ -e impossible ] && exit 2 ;;
esac
# With `pairs`, a recording waits for a second one at the same time; with `alone`, two steps at the
# same time are noted.
if [ "$1" = acquire ] && [ -e pairs ]; then
  touch "recording.$$"
  for try in $(seq 200); do
    [ "$(ls recording.* | wc -l)" -ge 2 ] && touch paired
    [ -e paired ] && break
    sleep 0.05
  done
  rm "recording.$$"
fi
if [ -e alone ]; then
  mkdir busy || touch overlapped
  sleep 0.02
  rmdir busy
fi
for last in "$@"; do :; done
case "$last" in
  identified/|diagnosed/|./identified/|./diagnosed/) mkdir -p "$last"
    for name in parameters.parquet residuals.parquet candidates.parquet detectability.json \\
        verdict.json; do
      touch "$last/$name"
    done ;;
  */) mkdir -p "$last"; touch "$last/rbf.parquet"; [ -e nosweep ] || touch "$last/kv-sweep.csv" ;;
  *) mkdir -p "$(dirname "$last")"; touch "$last" ;;
esac
"""


class Make:
    """make in a new experiment's folder; each call returns the commands that ran, by their first
    word."""

    def __init__(self, folder: Path):
        self.folder = folder
        self.log = folder / "log"

    def __call__(self, *arguments: str) -> list[str]:
        return [line.split()[0] for line in self.commands(*arguments)]

    def commands(self, *arguments: str) -> list[str]:
        """Return the whole commands that ran."""
        self.log.write_text("")
        environment = {**os.environ, "LOG": str(self.log), "MAKEFLAGS": ""}
        subprocess.run(
            ["make", "-C", str(self.folder), *arguments],
            check=True,
            env=environment,
            capture_output=True,
        )
        return self.log.read_text().splitlines()

    def change(self, old: str, new: str) -> None:
        path = self.folder / "exoid.toml"
        text = path.read_text()
        assert old in text
        path.write_text(text.replace(old, new))


@pytest.fixture
def make(tmp_path, monkeypatch):
    shipped = tmp_path / "datasets"
    shutil.copytree(datasets() / "rigs", shipped / "rigs")
    (shipped / "experiments").symlink_to(datasets() / "experiments")
    monkeypatch.setattr("pipelines.settings.template.datasets", lambda: shipped)
    stand_in = tmp_path / "stand-in"
    stand_in.write_text(STAND_IN)
    stand_in.chmod(0o755)
    create(tmp_path / "experiment", exoid=str(stand_in))
    return Make(tmp_path / "experiment")


FIT = ["identify", "simulate", "simulate", "simulate"]
DIAGNOSIS = ["diagnose", "simulate", "simulate", "simulate"]
ALL_FROM_RECORDINGS = [*["filter"] * 4, *FIT, *DIAGNOSIS, "report"]


def test_a_first_make_runs_every_stage_and_a_second_none(make):
    assert sorted(make()) == sorted(["design", *["acquire"] * 4, *ALL_FROM_RECORDINGS])
    assert make() == []


def test_make_calls_the_commands_of_the_graph_each_after_those_it_needs(make):
    config = make.folder / "exoid.toml"
    steps = graph(Experiment.load(config), Path("exoid.toml"), Path("."))
    called = [line.replace("./", "") for line in make.commands()]
    assert sorted(called) == sorted(" ".join(step.command).replace("./", "") for step in steps)
    place = {step.target: called.index(" ".join(step.command).replace("./", "")) for step in steps}
    for step in steps:
        assert all(place[file] < place[step.target] for file in step.inputs if file in place)


def test_a_new_experiment_has_every_stage_there_is(make):
    steps = graph(Experiment.load(make.folder / "exoid.toml"), Path("exoid.toml"), Path("."))
    assert tuple(dict.fromkeys(step.stage for step in steps)) == STAGES


def test_where_the_model_with_causes_cannot_move_all_else_is_made(make):
    (make.folder / "impossible").touch()
    assert sorted(make()) == sorted(["design", *["acquire"] * 4, *ALL_FROM_RECORDINGS])
    assert (make.folder / "report.html").is_file()
    assert not (make.folder / "simulated" / "extended").exists()


@pytest.mark.parametrize(
    ("file", "again"),
    [
        ("identified/residuals.parquet", [*FIT, "report"]),
        ("diagnosed/parameters.parquet", [*DIAGNOSIS, "report"]),
        ("diagnosed/detectability.json", [*DIAGNOSIS, "report"]),
        ("simulated/kv-sweep.csv", ["simulate", "report"]),
    ],
)
def test_where_one_of_the_files_of_a_step_is_missing_it_is_done_again(make, file, again):
    make()
    (make.folder / file).unlink()
    assert sorted(make()) == sorted(again)
    assert (make.folder / file).is_file()
    assert make() == []


def test_without_gains_to_sweep_no_table_of_them_is_waited_for(make):
    make.change("sweep_nm_s_rad = [", "sweep_nm_s_rad = [] # [")
    (make.folder / "nosweep").touch()
    make()
    assert make() == []


def test_an_imported_recording_is_nobodys_to_make(make):
    path = make.folder / "recordings" / "exo_alone_train.parquet"
    parquet.save(path, [pa.table({"time_s": [0.0]})], {"contract": "recording/1", "imported": {}})
    assert make().count("acquire") == 3
    path.touch()
    assert sorted(make()) == sorted(["filter", *FIT, *DIAGNOSIS, "report"])


def test_only_what_depends_on_a_change_runs_again(make):
    make()
    (make.folder / "exoid.toml").touch()
    assert make() == []
    make.change("[design]  ", "[design] # a comment")
    assert make() == []
    make.change("feedback_gain_nm_s_rad = 300.0", "feedback_gain_nm_s_rad = 400.0")
    assert make() == ["simulate", "simulate", "report"]
    make.change("[identify]\nfigures = true", "[identify]\nfigures = false")
    assert make() == [*FIT, "report"]
    make.change("known = []", 'known = ["rotor_inertia@knee"]')
    assert sorted(make()) == sorted([*DIAGNOSIS, "report"])
    make.change("order = 4", "order = 2")
    assert sorted(make()) == sorted(ALL_FROM_RECORDINGS)
    make.change("seed = 2", "seed = 22")
    assert sorted(make()) == sorted(["acquire", "filter", *FIT, *DIAGNOSIS, "report"])
    make.change("harmonics = 5", "harmonics = 4")
    assert sorted(make()) == sorted(["design", *["acquire"] * 4, *ALL_FROM_RECORDINGS])
    assert make() == []


def test_a_change_of_the_rig_records_again(make):
    make()
    rig = make.folder / "rigs" / "default.toml"
    rig.write_text(rig.read_text().replace("cuff_force_n = 400.0", "cuff_force_n = 300.0"))
    assert sorted(make()) == sorted(["acquire"] * 4 + ALL_FROM_RECORDINGS)


def test_a_change_of_what_the_rig_hides_records_again(make):
    make()
    sealed = make.folder / "rigs" / "sealed" / "default.toml"
    sealed.touch()
    assert make() == []
    sealed.write_text(sealed.read_text().replace("seed = 20", "seed = 21"))
    assert sorted(make()) == sorted(["acquire"] * 4 + ALL_FROM_RECORDINGS)
    assert make() == []


def test_make_goes_on_without_the_sealed_file(make):
    make()
    (make.folder / "rigs" / "sealed" / "default.toml").unlink()
    make.change("order = 4", "order = 2")
    assert "filter" in make()


def test_a_run_with_an_excitation_of_its_own_heeds_it_alone(make):
    (make.folder / "mine.toml").write_text("a = 1\n")
    make.change('# trajectory = "my_excitation.toml"', 'trajectory = "mine.toml"')
    make()
    make.change("harmonics = 5", "harmonics = 4")
    assert make().count("acquire") == 3


def test_without_a_run_to_validate_on_nothing_is_diagnosed(make):
    path = make.folder / "exoid.toml"
    path.write_text(path.read_text().replace('purpose = "validate"', 'purpose = "train"'))
    assert sorted(make()) == sorted(
        ["design", *["acquire", "filter"] * 4, "identify", "simulate", "report"]
    )


def test_clean_keeps_the_recordings(make):
    make()
    make("clean")
    assert {path.name for path in make.folder.iterdir()} == {
        "Makefile",
        "exoid.toml",
        "log",
        "recordings",
        "rigs",
    }


def test_two_virtual_rigs_record_at_the_same_time(make):
    (make.folder / "pairs").touch()
    make("-j2")
    assert (make.folder / "paired").is_file()


@pytest.mark.parametrize("rig", ["lab", "real_time"])
def test_a_rig_in_real_time_has_the_computer_to_itself(make, rig):
    make.change("rigs/default.toml", f"rigs/{rig}.toml")
    (make.folder / "alone").touch()
    assert sorted(make("-j4")) == sorted(["design", *["acquire"] * 4, *ALL_FROM_RECORDINGS])
    assert not (make.folder / "overlapped").exists()


def test_init_overwrites_nothing(make):
    with pytest.raises(SettingsError) as caught:
        create(make.folder, exoid="exoid")
    assert (
        str(caught.value)
        == f"{make.folder / 'exoid.toml'}: exists already, not overwritten; choose a new folder"
    )
