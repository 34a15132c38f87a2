"""Particle swarm with a ring or a global neighbourhood, compiled."""

from typing import NamedTuple

import numpy as np
from numba import njit
from numpy.typing import NDArray

from pipelines.design.fitness import cost, workspace


class Swarm(NamedTuple):
    """P particles in D dimensions."""

    position: NDArray
    velocity: NDArray
    """(P, D)."""
    best_position: NDArray
    """(P, D): the best position of each particle."""
    best_cost: NDArray
    """(P,)."""


@njit(cache=True)
def fly(swarm, problem, ring, iterations, rng):
    """Move the swarm a number of times, in place.

    Parameters
    ----------
    swarm : Swarm
        P particles.
    problem : Problem
        Bounds and criterion.
    ring : bool
        Whether a particle follows the best of its two neighbours instead of the swarm's best.
    iterations : int
        Number of moves.
    rng : numpy.random.Generator
        Source of random numbers.
    """
    # Constriction makes the swarm contract (Clerc and Kennedy, 2002, IEEE Trans. Evol. Comput.
    # 6(1)).
    inertia, pull = 0.7298, 1.49618
    work = workspace(problem)
    particles, dimensions = swarm.position.shape
    # Without a ring, all particles follow the best one.
    leader = int(np.argmin(swarm.best_cost))
    for _ in range(iterations):
        for i in range(particles):
            if ring:
                leader = i
                for neighbour in ((i - 1) % particles, (i + 1) % particles):
                    if swarm.best_cost[neighbour] < swarm.best_cost[leader]:
                        leader = neighbour
            x, v = swarm.position[i], swarm.velocity[i]
            for d in range(dimensions):
                own = swarm.best_position[i, d] - x[d]
                theirs = swarm.best_position[leader, d] - x[d]
                v[d] = inertia * v[d] + pull * (rng.random() * own + rng.random() * theirs)
                x[d] += v[d]
            # It repairs x in place, so that the particle itself returns into the bounds.
            value = cost(x, problem, work)
            if value < swarm.best_cost[i]:
                swarm.best_cost[i] = value
                for d in range(dimensions):
                    swarm.best_position[i, d] = x[d]
                # Without a ring, a better particle leads from now on, within the same sweep.
                if value < swarm.best_cost[leader]:
                    leader = i
