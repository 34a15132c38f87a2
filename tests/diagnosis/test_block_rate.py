"""In the decision band, a candidate's rows that are computed once a block are those of the full
rate."""

import numpy as np
import pytest

from pipelines.diagnosis.candidates import candidate_rows
from pipelines.diagnosis.candidates.candidate import TURNS, Candidate, proposals
from pipelines.diagnosis.candidates.candidate_rows import CandidateRows
from pipelines.diagnosis.candidates.shape_grid import values_in
from tests.diagnosis.screening import Screening
from tests.diagnosis.sessions import session


@pytest.fixture(scope="module")
def look():
    return Screening.of(session())


@pytest.fixture(scope="module")
def at_full_rate(look):
    """Rows as they come out where every column is computed at each sample."""
    with pytest.MonkeyPatch.context() as patch:
        patch.setattr(candidate_rows, "at_block_rate", lambda run: run)
        return CandidateRows(look.prepared.runs, look.prepared.baseline, look.regression)


def shape_of(effect, runs) -> tuple[float, ...]:
    """Return a shape in the middle of the effect's range."""
    if chosen := effect.directions([run.motion for run in runs]):
        return chosen[0][0]
    tried = (values_in(effect, parameter, 3, runs) for parameter in effect.shape)
    return tuple(float(values[len(values) // 2]) for values in tried)


def sizes(look, at_full_rate, candidate) -> tuple[float, float]:
    """Return the length of a candidate's rows and of what a full rate changes in them, both in
    units of the noise.

    The baseline is projected out of both, as it is of all that the decision compares.
    """
    near, exact = (look.regression.project(rows(candidate)) for rows in (look.rows, at_full_rate))
    return float(np.linalg.norm(exact)), float(np.linalg.norm(near - exact))


def effect_labelled(look, label):
    kinds = [run.motion.run for run in look.prepared.runs]
    return next(
        effect for effect in proposals(look.prepared.baseline, kinds) if effect.label == label
    )


def test_rows_once_a_block_are_within_a_few_per_cent_of_those_at_the_full_rate(look, at_full_rate):
    runs, checked = look.prepared.runs, []
    for effect in proposals(look.prepared.baseline, [run.motion.run for run in runs]):
        waves = any(parameter.unit in TURNS for parameter in effect.shape)
        if waves or not effect.shows_in([run.motion for run in runs]):
            continue
        size, change = sizes(
            look, at_full_rate, Candidate(effect, (shape_of(effect, runs),) * len(runs))
        )
        assert change < 0.05 * size + 1e-9, effect.label
        checked += [effect] if size > 0.0 else []
    assert len(checked) > 40
    assert {effect.name for effect in checked if effect.swings} == {
        "joint_elasticity",
        "cuff_compliance",
        "backlash",
    }


@pytest.mark.parametrize(
    "label", ["joint_elasticity@hip", "joint_elasticity@knee", "cuff_compliance@knee"]
)
@pytest.mark.parametrize("stiffness", [60.0, 1000.0, 6000.0])
def test_a_transmissions_rows_are_followed_at_any_stiffness(look, at_full_rate, label, stiffness):
    """Within 5 %, or by less than two of the log likelihood in 40 s where a stiff one hardly does
    anything.

    What a stiff hip swings at, 8 Hz, rings a little at the blocks' corners: a seventieth of its log
    likelihood.
    """
    effect, runs = effect_labelled(look, label), look.prepared.runs
    shape = (stiffness, *shape_of(effect, runs)[1:])
    size, change = sizes(look, at_full_rate, Candidate(effect, (shape,) * len(runs)))
    within = 0.12 if (label, stiffness) == ("joint_elasticity@hip", 6000.0) else 0.05
    assert change < within * size or 0.5 * change**2 < 2.0


def test_a_wave_that_goes_by_within_a_few_blocks_is_computed_at_the_full_rate(look, at_full_rate):
    cogging = effect_labelled(look, "cogging@knee")
    for cycles, once_a_block in ((6.0, True), (200.0, False)):
        size, change = sizes(
            look, at_full_rate, Candidate(cogging, ((cycles,),) * len(look.prepared.runs))
        )
        assert size > 0.0 and (change > 0.0) == once_a_block
        assert change < 0.05 * size
