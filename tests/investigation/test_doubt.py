"""What a verdict leaves open, and what not."""

import json

import pytest

from pipelines.contracts.verdict import read
from pipelines.investigation.doubt import State, doubt_of
from pipelines.wording.label import NOTHING
from tests.report.sessions import decision_of, write_verdict


@pytest.fixture
def doubt(tmp_path):
    def of(change=lambda document: None, **decision):
        write_verdict(tmp_path, **decision_of(**decision))
        file = tmp_path / "diagnosed" / "verdict.json"
        document = json.loads(file.read_text())
        change(document)
        file.write_text(json.dumps(document))
        return doubt_of(read(file))

    return of


def test_ties_are_open(doubt):
    found = doubt()
    assert found.state is State.OPEN
    assert set(found.probabilities) == {"cogging@knee", "parallel_spring@knee"}


@pytest.mark.parametrize(("nothing", "state"), [(0.01, State.NAMED), (0.1, State.OPEN)])
def test_one_cause_is_decided_by_its_probability(doubt, nothing, state):
    found = doubt(ties=(), nothing=nothing, law=0.0)
    assert found.state is state
    if state is State.OPEN:
        assert found.probabilities == pytest.approx({"cogging@knee": 0.9, NOTHING: 0.1})


def test_an_improbable_tie_is_no_rival(doubt):
    def change(document):
        first, second = document["findings"][0]["causes"]
        first["probability"], second["probability"] = 0.93, 0.02

    found = doubt(change, nothing=0.02, law=0.03)
    assert "parallel_spring@knee" not in found.probabilities


def test_a_dropped_cause_is_no_rival(doubt):
    def change(document):
        document["findings"][0]["causes"][1]["dropped"] = True

    assert "parallel_spring@knee" not in doubt(change).probabilities


def test_an_unlisted_law_of_the_motion_is_a_rival(doubt):
    found = doubt(ties=(), nothing=0.01, law=0.2)
    assert found.state is State.OPEN
    assert set(found.probabilities) == {"cogging@knee", "law:angle@knee"}
    assert "a law of the knee's angle" in found.words


@pytest.mark.parametrize("law", ["law:time@knee", "law:hum@knee", "law:unlisted_angle@knee"])
def test_a_law_that_no_motion_shows_better_is_no_rival(doubt, law):
    def change(document):
        document["posterior"]["laws"] = {law: 0.2}

    found = doubt(change, ties=(), nothing=0.01, law=0.2)
    assert found.state is State.UNLISTED
    assert "unlisted law" in found.words


def test_a_law_beside_a_cause_is_no_rival_of_it(doubt):
    def change(document):
        document["posterior"]["laws"] = {"law:angle@knee": 0.9}

    assert "law:angle@knee" not in doubt(change).probabilities


def test_nothing_is_decided_unless_a_cause_is_close(doubt):
    def change(document, close=0.02):
        document["findings"] = []
        document["posterior"] |= {"nothing_missing": 0.97 - close, "unlisted": 0.01}
        document["posterior"]["causes"] = {"cogging@knee": close}

    assert doubt(change).state is State.NOTHING
    found = doubt(lambda document: change(document, close=0.3))
    assert found.probabilities == pytest.approx({NOTHING: 0.67, "cogging@knee": 0.3})


def test_nothing_is_not_decided_where_an_unlisted_law_is_likely(doubt):
    def change(document):
        document["findings"] = []
        document["posterior"] |= {"nothing_missing": 0.55, "unlisted": 0.4, "causes": {}}

    assert doubt(change).state is State.UNLISTED


def test_what_is_not_decided_is_not_shown_as_if_it_were(doubt):
    found = doubt(ties=(), nothing=0.0544, law=0.0)
    assert "(0.9456)" in found.words


def test_where_acquisition_is_at_fault_nothing_is_said_of_physics(doubt):
    def change(document):
        document.update(acquisition_at_fault=True, posterior=None, findings=[])

    assert doubt(change).state is State.AT_FAULT
