"""Two examinations are compared case by case."""

from dataclasses import replace

import pytest

from tests.campaigns.blind.compare import Changes, main, matched, tables
from tests.campaigns.blind.report import Examination, write
from tests.campaigns.blind.scoring import Score

CASE = Score(
    seed=1,
    category="single",
    truth=(("backlash", "knee"),),
    forms=("some",),
    own_form=False,
    magnitude=0.1,
    visibility=1.0,
    kinds=("exo_alone",),
    status="explained",
    named=(("backlash", "knee"),),
    right=True,
    probabilities=((0.9, True),),
    world="planar",
)
WRONG = {"right": False, "named": (("cogging", "hip"),), "probabilities": ((0.9, False),)}


def scores(*right):
    return [replace(CASE, seed=k, **({} if yes else WRONG)) for k, yes in enumerate(right)]


@pytest.mark.parametrize(
    # Two-sided binomial: 2 P(X <= fewer) of so many fair coins.
    ("only_old", "only_new", "p"),
    [(0, 0, 1.0), (1, 5, 2 * 7 / 64), (0, 6, 2 / 64), (5, 5, 1.0)],
)
def test_mcnemars_p_value_is_the_binomials(only_old, only_new, p):
    assert Changes(20, only_old, only_new, 3).p_value == pytest.approx(p)


def test_cases_are_matched_by_seed_world_and_what_is_hidden():
    old = [CASE, replace(CASE, seed=2), replace(CASE, seed=3, world="mujoco")]
    new = [replace(CASE, seed=3), replace(CASE, seed=2, **WRONG)]
    assert [(a.seed, a.right, b.right) for a, b in matched(old, new)] == [(2, True, False)]


def test_the_tables_count_who_is_right_where_the_other_is_not():
    pages = {p.title: p for p in tables(matched(scores(1, 1, 0, 0), scores(1, 0, 1, 1)))}
    assert pages["By category"].rows[0] == ("all", "4", "2", "3", "1", "2", "1")
    assert pages["By world"].rows[1][0] == "planar"
    assert [row[-1] for row in pages["Changed cases"].rows] == ["worse", "better", "better"]


def test_two_records_are_compared_from_their_files(tmp_path, capsys):
    for name, right in (("old", (1, 0)), ("new", (1, 1))):
        write(tmp_path / name, Examination("python -m tests.campaigns.blind", scores(*right)))
    main(tmp_path / "old" / "report.json", tmp_path / "new" / "report.json")
    assert "| all | 2 | 1 | 2 | 0 | 1 | 1 |" in capsys.readouterr().out
