"""An unlisted law as a rival: what it can be, and what tells it from a cause."""

from dataclasses import replace

import numpy as np
import pytest

from pipelines.design.excitation import design
from pipelines.investigation.law_shape import LawShape, can_be_planned
from pipelines.investigation.planned import PlannedRuns
from pipelines.investigation.rivals import Rival
from pipelines.investigation.separation_problem import SeparationProblem
from pipelines.model import Term, effect_named
from pipelines.settings.design import DesignSettings
from pipelines.settings.rig.plant import PlantSettings
from pipelines.wording.law import LAWS, law_label

QUICK = DesignSettings(harmonics=3, particles=24, iterations=50)
RUNS = PlannedRuns(QUICK, PlantSettings())


@pytest.fixture(scope="module")
def usual():
    return design(QUICK).trajectory


@pytest.mark.parametrize("kind", [kind for kind in LAWS if can_be_planned(f"law:{kind}")])
def test_a_law_has_columns_of_its_own_joint(usual, kind):
    problem = RUNS.problem(usual, [])
    label = law_label(kind, None if kind == "across_joints" else "knee")
    law = LawShape.of(label, problem, QUICK.bounds)
    parts = law.parts(problem)
    assert parts[0].shape[2] == len(law.typical) > 0
    assert np.abs(parts[0][:, 1]).max() > 0.0
    if kind != "across_joints":
        assert not parts[0][:, 0].any()


def test_a_law_of_the_angle_stays_bounded_on_all_that_the_leg_reaches(usual):
    # The diagnosed motion has a tenth of the range: a polynomial on it alone would explode beyond.
    small = replace(usual, a=0.1 * usual.a, b=0.1 * usual.b)
    law = LawShape.of("law:angle@knee", RUNS.problem(small, []), QUICK.bounds)
    wide = law.parts(RUNS.problem(usual, []))[0][:, 1]
    assert np.abs(wide).max() < 1.01 * law.spans.torque[1]


def test_a_motion_tells_a_law_from_a_cause_that_looked_like_it(usual):
    # On a third of the range a spring looks like many a law of the angle.
    spring = effect_named("parallel_spring")(joint="knee")
    small = replace(usual, a=0.3 * usual.a, b=0.3 * usual.b)
    fitted = Rival(spring, 0.7, Term(spring, np.array([1.0, 0.0])))
    rivals = [fitted, Rival(None, 0.3, law="law:angle@knee")]
    problem = SeparationProblem.of(rivals, RUNS.after([small]), small)
    again, wide = (problem.with_motion(one) for one in (small, usual))
    odds = wide.log_odds()
    # A law that is no spring shows. If it is a spring, the law pays for its freedom.
    assert odds[1, 0] > again.log_odds()[1, 0] + 5.0 and odds[0, 1] > 2.0
    assert wide.decides() > again.decides() + 0.3
