"""The runs that an investigation adds to an experiment."""

import pytest

from pipelines.contracts.verdict import read
from pipelines.errors import InputError, SettingsError
from pipelines.settings import Experiment
from pipelines.settings.template import create
from pipelines.workflow.graph import graph
from pipelines.workflow.imported import ImportedRuns
from pipelines.workflow.investigation import (
    last_step,
    motion_of,
    motions_of,
    refuse_lost_motion,
    refuse_lost_verdicts,
    step_diagnosed,
    with_investigation,
)
from pipelines.workflow.split import split
from tests.report.sessions import write_verdict


@pytest.fixture
def folder(tmp_path):
    create(tmp_path, "exoid")
    for step in (1, 2):
        motion_of(tmp_path, step).parent.mkdir(parents=True)
        motion_of(tmp_path, step).touch()
    return tmp_path


def load(folder, imported=ImportedRuns()):
    return with_investigation(Experiment.load(folder / "exoid.toml"), imported, folder)


def test_every_run_is_repeated_in_each_step_with_other_noise(folder):
    own = Experiment.load(folder / "exoid.toml").run
    runs = load(folder).run
    assert len(runs) == 3 * len(own)
    assert [run.step for run in runs] == [0] * 4 + [1] * 4 + [2] * 4
    assert len({run.seed for run in runs}) == len(runs)
    for run in runs[len(own) :]:
        base = next(one for one in own if run.name == f"{one.name}+{run.step}")
        kept = ("run", "purpose", "duration_s")
        assert [getattr(run, key) for key in kept] == [getattr(base, key) for key in kept]


def test_adding_them_twice_changes_nothing(folder):
    once = load(folder)
    assert with_investigation(once, ImportedRuns(), folder).run == once.run


def test_an_imported_run_is_not_repeated(folder):
    runs = load(folder, ImportedRuns(frozenset({"exo_alone_train"}))).run
    assert "exo_alone_train" in [run.name for run in runs]
    assert "exo_alone_train+1" not in [run.name for run in runs]


def test_a_step_without_a_motion_and_those_after_it_do_not_count(folder):
    motion_of(folder, 1).unlink()
    assert last_step(folder) == 0
    assert motions_of(load(folder), folder) == [folder / "trajectory.parquet"]


def test_a_run_s_own_excitation_is_a_motion_of_the_experiment(folder):
    text = (folder / "exoid.toml").read_text()
    mine = 'purpose = "train"\ntrajectory = "mine.toml"\n'
    (folder / "exoid.toml").write_text(text.replace('purpose = "train"\n', mine, 1))
    assert motions_of(load(folder), folder) == [
        folder / "mine.toml",
        folder / "trajectory.parquet",
        motion_of(folder, 1),
        motion_of(folder, 2),
    ]


def test_a_motion_whose_recordings_were_not_diagnosed_does_not_count(folder):
    for inputs, last in (([folder / "one+1.parquet"], 1), ([folder / "trajectory.parquet"], 0)):
        inputs[0].touch()
        write_verdict(folder, inputs=inputs)
        verdict = read(folder / "diagnosed" / "verdict.json")
        assert step_diagnosed(verdict) == last
        motions = motions_of(load(folder), folder, step_diagnosed(verdict))
        assert motions == [folder / "trajectory.parquet", motion_of(folder, 1)][: last + 1]


def test_a_run_of_a_step_is_found_by_its_name_alone(folder):
    experiment = Experiment.load(folder / "exoid.toml")
    assert experiment.run_named("exo_alone_train+2") == load(folder).run[8]
    for name in ("exo_alone_train+", "exo_alone_train+x", "exo_alone_train+0", "nobody+1"):
        with pytest.raises(SettingsError, match="has no"):
            experiment.run_named(name)


def test_further_runs_follow_their_step_s_motion_and_are_diagnosed_with_the_others(folder):
    steps = graph(load(folder), folder / "exoid.toml", folder)
    recorded = {step.run: step for step in steps if step.stage == "acquire"}
    assert len(recorded) == 12
    assert folder / "trajectory.parquet" in recorded["exo_alone_train"].inputs
    assert motion_of(folder, 2) in recorded["exo_alone_train+2"].inputs
    (diagnosed,) = (step for step in steps if step.stage == "diagnose")
    assert {step.target for step in recorded.values()} <= set(diagnosed.inputs)


def test_make_has_the_same_rules(folder):
    split(Experiment.load(folder / "exoid.toml"), folder / ".settings")
    rules = (folder / ".settings" / "graph.mk").read_text()
    assert "$(OUT)/recordings/exo_alone_train+1.parquet: $(OUT)/investigation/1/" in rules


def test_a_recording_whose_motion_is_missing_is_not_left_out_of_results(folder):
    recording = folder / "recordings" / "exo_alone_train+2.parquet"
    recording.parent.mkdir()
    recording.touch()
    refuse_lost_motion(load(folder), folder)
    motion_of(folder, 2).unlink()
    with pytest.raises(InputError, match=r"2.trajectory.parquet: no such file.*train\+2.parquet"):
        refuse_lost_motion(load(folder), folder)
    with pytest.raises(InputError, match="no such file"):
        split(Experiment.load(folder / "exoid.toml"), folder / ".settings")
    # An imported run is not repeated, although a motion is there.
    motion_of(folder, 2).touch()
    refuse_lost_motion(load(folder, ImportedRuns(frozenset({"exo_alone_train"}))), folder)
    motion_of(folder, 2).unlink()
    # A run that exoid.toml no longer has is left out on purpose.
    recording.rename(recording.with_name("former+2.parquet"))
    refuse_lost_motion(load(folder), folder)


def test_a_step_whose_motion_is_missing_is_not_designed_again_before_a_later_one(folder):
    motion_of(folder, 1).unlink()
    with pytest.raises(InputError, match=r"1.trajectory.parquet: no such file.*2.trajectory"):
        refuse_lost_motion(load(folder), folder)


@pytest.mark.parametrize("content", [None, '{"status": "o'])
def test_a_step_without_a_whole_verdict_is_refused(folder, content):
    if content:
        (folder / "investigation" / "1" / "verdict.json").write_text(content)
    with pytest.raises(
        InputError, match=r"1.verdict.json: is missing or damaged; .* before step 1"
    ):
        refuse_lost_verdicts(folder)
