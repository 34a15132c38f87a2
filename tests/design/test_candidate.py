"""A search can start from an excitation of an earlier one."""

import numpy as np
import pytest

from pipelines.design.search import (
    candidate_of,
    first_swarm,
    search_problem,
    spread_of,
    trajectory_of,
)
from pipelines.mechanics.geometry import Geometry
from pipelines.settings.design import DesignSettings

QUICK = DesignSettings(harmonics=3, particles=4)


def searched(**changes):
    """Return a search's problem, and the excitation of one of its particles."""
    settings = QUICK.changed(**changes)
    problem = search_problem(settings, Geometry(), samples=100, samples_per_harmonic=10)
    swarm = first_swarm(settings, problem, spread_of(problem), np.random.default_rng(1))
    return problem, trajectory_of(swarm.position[0], problem)


@pytest.mark.parametrize("changes", [{}, {"theta0_rad": (0.65, -0.93)}, {"rest_to_rest": True}])
def test_an_excitation_s_candidate_has_that_excitation(changes):
    problem, motion = searched(**changes)
    again = trajectory_of(candidate_of(motion, problem), problem)
    for key in ("a", "b", "theta0", "omega"):
        assert np.allclose(getattr(again, key), getattr(motion, key))


@pytest.mark.parametrize("changes", [{"harmonics": 2}, {"base_frequency_hz": 0.2}])
def test_an_excitation_of_other_frequencies_has_no_candidate(changes):
    _, motion = searched(**changes)
    assert candidate_of(motion, searched()[0]) is None
