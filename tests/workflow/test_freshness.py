"""Done, stale and missing: what a step's file was made of, against what is there now."""

import json
import os
from dataclasses import replace
from pathlib import Path

import pandas as pd
import pytest

from pipelines.contracts import describe
from pipelines.workflow.freshness import Freshness, Judge
from pipelines.workflow.graph import Step, needed_for


class Chain:
    """Two steps, first -> second, from one input of the user's."""

    def __init__(self, folder: Path):
        self.folder = folder
        self.source, self.order = folder / "source.json", 4
        self.source.write_text("1")

    @property
    def steps(self) -> tuple[Step, Step]:
        first, second = self.folder / "first.json", self.folder / "second.json"
        settings = {"filter": {"order": self.order, "cutoff_hz": "auto"}}
        return (
            Step("one", first, (self.source,), settings, ("one",), watched=self.folder / "sealed"),
            Step("two", second, (first,), {}, ("two",)),
        )

    def make(self) -> None:
        (self.folder / "sealed").touch()
        for step in self.steps:
            provenance = describe(step.inputs, step.settings)
            step.target.write_text(json.dumps({"contract": "x/1", "provenance": provenance}))

    def states(self) -> dict[str, tuple[str, tuple[str, ...]]]:
        return {
            one.step.stage: (one.state.value, one.why) for one in Judge(self.folder).all(self.steps)
        }


@pytest.fixture
def chain(tmp_path):
    chain = Chain(tmp_path)
    chain.make()
    return chain


def test_what_was_made_of_what_is_there_is_done_whatever_the_times(chain):
    os.utime(chain.source)
    assert chain.states() == {"one": ("done", ()), "two": ("done", ())}


def test_another_input_makes_stale_what_was_made_of_it_and_what_follows(chain):
    chain.source.write_text("2")
    assert chain.states() == {
        "one": ("stale", ("source.json has changed",)),
        "two": ("stale", ("waits for one",)),
    }


def test_another_setting_is_named_with_both_values_and_changed_back_it_is_forgotten(chain):
    chain.order = 2
    assert chain.states()["one"] == ("stale", ("filter.order was 4, is 2",))
    chain.order = 4
    assert chain.states()["one"] == ("done", ())


def test_what_is_not_there_is_missing_and_what_follows_waits(chain):
    chain.steps[0].target.unlink()
    assert chain.states() == {"one": ("missing", ()), "two": ("stale", ("waits for one",))}


def test_an_input_that_nobody_makes_and_is_gone_is_named(chain):
    chain.source.unlink()
    assert chain.states()["one"] == ("stale", ("source.json is missing",))


def test_a_newer_sealed_file_counts_though_no_result_tells_its_hash(chain):
    newer = chain.steps[0].target.stat().st_mtime + 10
    os.utime(chain.folder / "sealed", (newer, newer))
    assert chain.states()["one"] == ("stale", ("sealed is newer",))


def test_another_set_of_inputs_is_named(chain):
    step = chain.steps[1]
    step.target.write_text(json.dumps({"provenance": describe([chain.source])}))
    assert chain.states()["two"] == (
        "stale",
        ("first.json was not among its inputs", "source.json is no longer an input"),
    )


def test_what_may_be_impossible_and_is_not_there_is_done_without(chain):
    first, second = chain.steps
    first.target.unlink()
    assert Judge(chain.folder).all([replace(first, may_fail=True), second])[1].done


def test_two_inputs_of_one_name_differ_by_their_content(chain):
    first, second = chain.steps
    other = chain.folder / "other" / "first.json"
    other.parent.mkdir()
    other.write_text("{}")
    both = replace(second, inputs=(first.target, other))
    second.target.write_text(json.dumps({"provenance": describe(both.inputs)}))
    assert Judge(chain.folder).judge(both).done
    other.write_text("[]")
    assert Judge(chain.folder).judge(both).why == ("other/first.json has changed",)


def test_a_report_that_takes_all_may_have_taken_more(chain):
    step = replace(chain.steps[1], takes_all=True)
    step.target.write_text(json.dumps({"provenance": describe([*step.inputs, chain.source])}))
    assert Judge(chain.folder).judge(step).done


@pytest.mark.parametrize("content", ["", "{", "{}", "[1]"])
def test_a_damaged_result_is_stale(chain, content):
    chain.steps[1].target.write_text(content)
    assert chain.states()["two"] == ("stale", ("has no record of its origin; make it again",))


def test_a_step_is_done_where_all_its_files_are_there(chain):
    first, second = chain.steps
    others = chain.folder / "beside.parquet"
    step = replace(first, other_outputs=(others,))
    steps = (step, replace(second, inputs=(*step.makes,)))

    def states():
        return [(one.state.value, one.why) for one in Judge(chain.folder).all(steps)]

    pd.DataFrame({"a": [1]}).to_parquet(others)
    second.target.write_text(json.dumps({"provenance": describe(step.makes)}))
    assert states() == [("done", ()), ("done", ())]
    others.write_bytes(others.read_bytes()[:-1])
    assert states()[0] == ("stale", ("beside.parquet is damaged",))
    others.unlink()
    assert states() == [("stale", ("beside.parquet is missing",)), ("stale", ("waits for one",))]


def test_a_file_that_a_result_tells_of_as_made_with_it_must_be_there(chain):
    second = chain.steps[1]
    second.target.write_text(
        json.dumps({"provenance": describe(second.inputs) | {"beside": ["loop.json"]}})
    )
    assert chain.states()["two"] == ("stale", ("loop.json is missing",))
    (chain.folder / "loop.json").touch()
    assert chain.states()["two"] == ("done", ())


def test_the_remains_of_a_killed_or_stopped_run_are_named(tmp_path):
    (tmp_path / "a.parquet.journal").touch()
    (tmp_path / "a.aborted.parquet").touch()
    judged = Judge(tmp_path).judge(Step("acquire", tmp_path / "a.parquet", (), {}, ("acquire",)))
    assert judged.state is Freshness.MISSING
    assert judged.why == (
        "a run was killed: `exoid recover` makes a recording of a.parquet.journal",
        "a run was stopped early: a.aborted.parquet",
    )


def test_what_was_impossible_is_left_out_once_the_rest_was_made_without_it(chain):
    first, second = chain.steps
    steps = (replace(first, may_fail=True), second)
    first.target.unlink()
    second.target.write_text(json.dumps({"provenance": describe([])}))
    assert [one.state.value for one in Judge(chain.folder).all(steps)] == ["left out", "done"]
    second.target.unlink()
    assert [one.state.value for one in Judge(chain.folder).all(steps)] == ["missing", "missing"]


def test_a_stage_needs_what_makes_its_inputs_and_nothing_else(chain):
    first, second = chain.steps
    assert needed_for([second], chain.steps) == [first, second]
    assert needed_for([first], chain.steps) == [first]
