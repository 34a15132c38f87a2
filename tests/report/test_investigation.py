"""The report's card of an investigation, and what is no verdict of the session."""

import pytest

from pipelines.contracts import TRAJECTORY
from pipelines.report.html.report import report
from pipelines.report.session import find
from pipelines.workflow.investigation import step_folder
from tests.report.sessions import decision_of, write_session, write_trajectory, write_verdict

CARD = "The steps of the investigation"


@pytest.fixture
def investigated(tmp_path):
    """Write a session with one step: its verdict before was open, and the one after is not."""
    write_session(tmp_path)
    new = step_folder(tmp_path, 1)
    new.mkdir(parents=True)
    write_trajectory(new)
    table = TRAJECTORY.read(new / "trajectory.parquet")
    TRAJECTORY.write(new / "trajectory.parquet", table.frame, table.metadata | {"decides": 0.42})
    write_verdict(new, **decision_of())
    (new / "diagnosed" / "verdict.json").rename(new / "verdict.json")
    (new / "diagnosed").rmdir()
    write_verdict(tmp_path, **decision_of(ties=(), nothing=0.01, law=0.0))
    return tmp_path


def test_the_card_has_each_cause_s_probability_after_each_step(investigated):
    page = report(find([investigated]))
    card = page[page.index(CARD) :].partition("</table>")[0]
    assert "expected to decide: 42%" in card
    assert "cogging" in card and "parallel spring" in card
    # 2 / 3 and 1 / 3 of 0.95 before the step, 0.99 and 0 after it.
    for probability in ("0.63", "0.99", "0.32", "0.00"):
        assert f"<b>{probability}</b>" in card


def test_a_session_without_steps_has_no_card(tmp_path):
    assert CARD not in report(find([write_session(tmp_path)]))


def test_the_verdict_before_a_step_is_no_verdict_of_the_session(investigated):
    (investigated / "diagnosed" / "verdict.json").unlink()
    assert find([investigated]).verdict is None


def test_a_damaged_verdict_before_a_step_costs_the_card_and_not_the_page(investigated):
    (step_folder(investigated, 1) / "verdict.json").write_text("{")
    page = report(find([investigated]))
    assert CARD not in page
    assert "investigation/1/verdict.json" in page
