"""Speed of ``exoid design``: its fitness against NumPy's SVD, its search against pyswarms.

Run with ``python -m tests.campaigns.bench.bench_design``. pyswarms comes with the extra
``bench``. Times are processor time, so that a busy machine does not decide.
"""

import contextlib
import tempfile
import time
from collections.abc import Callable, Iterator

import numpy as np

from pipelines.design.excitation import design
from pipelines.design.fitness import cost, costs, expand, problem, workspace
from pipelines.design.search import basis_of, spread_of
from pipelines.design.swarm import Swarm, fly
from pipelines.mechanics.fourier import FourierTrajectory
from pipelines.mechanics.geometry import Geometry
from pipelines.mechanics.limits import bounds_array
from pipelines.settings.design import DesignSettings, JointBounds
from tests.campaigns.bench.report import Row, show

OMEGA, SAMPLES = 0.2 * np.pi, 1000
HARMONICS = 5
PARTICLES, ITERATIONS = 64, 100
GOAL = 11.9
"""Condition number, n = 5, mean angles free."""
PATIENCE_S = 30.0
GEOMETRY, BOUNDS = Geometry(), bounds_array(JointBounds())
TIME = np.arange(SAMPLES) * 2.0 * np.pi / OMEGA / SAMPLES
OF = problem(
    omega=OMEGA,
    harmonics=HARMONICS,
    bounds=BOUNDS,
    geometry=GEOMETRY,
    criterion="condition",
    theta0=None,
    basis=basis_of(HARMONICS, rest_to_rest=False),
    samples=SAMPLES,
)
SPREAD = spread_of(OF)


def numpy_cost(candidate: np.ndarray) -> float:
    """Evaluate a candidate as one would with NumPy alone: whole arrays, then the SVD; bounds by
    penalty."""
    coefficients = np.empty((2, 2, HARMONICS))
    expand(candidate, OF, coefficients)
    q, dq, ddq = FourierTrajectory(candidate[-2:], coefficients[0], coefficients[1], OMEGA).at(TIME)
    motion = np.array([q, dq, ddq])
    if (motion.min(axis=1) < BOUNDS[..., 0]).any() or (motion.max(axis=1) > BOUNDS[..., 1]).any():
        return np.inf
    return float(np.linalg.cond(numpy_regressor(q, dq, ddq)))


def numpy_regressor(q: np.ndarray, dq: np.ndarray, ddq: np.ndarray) -> np.ndarray:
    """The eight columns in NumPy, (2 N, 8)."""
    length, gravity = GEOMETRY.array()
    (q1, q2), (v1, v2), (a1, a2) = q.T, dq.T, ddq.T
    nothing, leg = np.zeros_like(q1), gravity * np.sin(q1 + q2)
    hip = length * ((2 * a1 + a2) * np.cos(q2) - (2 * v1 * v2 + v2**2) * np.sin(q2)) + leg
    knee = length * (a1 * np.cos(q2) + v1**2 * np.sin(q2)) + leg
    rows = [
        [a1, a2, hip, gravity * np.sin(q1), np.sign(v1), v1, nothing, nothing],
        [nothing, a1 + a2, knee, nothing, nothing, nothing, np.sign(v2), v2],
    ]
    return np.concatenate([np.column_stack(row) for row in rows])


def rows() -> Iterator[Row]:
    """Measure."""
    yield from fitness_rows()
    yield from search_rows()


def fitness_rows() -> Iterator[Row]:
    """Compare one evaluation of a motion that keeps its bounds; the fastest of several rounds."""
    candidate, work = (
        0.1 * np.random.default_rng(0).standard_normal(len(SPREAD)) * SPREAD,
        workspace(OF),
    )
    candidate[-2:] = 0.6, -0.9
    assert abs(cost(candidate, OF, work) / numpy_cost(candidate) - 1.0) < 1e-6
    many = np.tile(candidate, (200, 1))
    ours = fastest(lambda: costs(many, OF)) / len(many)
    theirs = fastest(lambda: [numpy_cost(candidate) for _ in range(50)]) / 50
    yield Row("fitness by NumPy's SVD, N = 1000", f"{1e6 * theirs:.0f} us")
    yield Row("fitness of exoid, N = 1000", f"{1e6 * ours:.1f} us", theirs / ours, "20")


def search_rows() -> Iterator[Row]:
    """Compare searches at equal evaluations and at equal quality."""
    # Compiled before the clock starts.
    design(DesignSettings(criterion="condition", iterations=1, seconds=0.1))
    budget = f"{PARTICLES} x {ITERATIONS}"
    ours, value = timed(exoid_swarm)
    yield Row(f"swarm of exoid, {budget} evaluations", f"{ours:.2f} s, reaches {value:.1f}")
    whole, found = timed(
        lambda: design(DesignSettings(criterion="condition", seed=0)).quality.condition
    )
    yield Row("whole search of exoid", f"{whole:.2f} s, reaches {found:.2f}")
    # pyswarms writes a log file wherever it is used.
    with tempfile.TemporaryDirectory() as folder, contextlib.chdir(folder):
        compared = list(pyswarms_rows(ours, whole))
    yield from compared


def pyswarms_rows(swarm_s: float, search_s: float) -> Iterator[Row]:
    """Give pyswarms the same number of evaluations, then time until it is as good."""
    import pyswarms

    budget = f"{PARTICLES} x {ITERATIONS}"
    objectives = {
        "NumPy's fitness": lambda x: np.array([numpy_cost(one) for one in x]),
        "exoid's fitness": our_costs,
    }
    for name, objective in objectives.items():
        optimizer = pyswarms_swarm(pyswarms, PARTICLES)
        theirs, value = timed(
            lambda o=optimizer, f=objective: o.optimize(f, ITERATIONS, verbose=False)[0]
        )
        yield Row(
            f"pyswarms, {name}, {budget} evaluations",
            f"{theirs:.2f} s, reaches {value:.1f}",
            theirs / swarm_s,
        )
    theirs, value = timed(lambda: until_goal(pyswarms_swarm(pyswarms, 128)))
    outcome = f"reaches {value:.2f}" if value <= GOAL else f"gives up at {value:.2f}"
    yield Row(
        f"pyswarms, exoid's fitness, until {GOAL}",
        f"{theirs:.2f} s, {outcome}",
        theirs / search_s,
        "over 1",
    )


def exoid_swarm() -> float:
    """Let exoid's swarm fly, ring topology, fine grid."""
    rng = np.random.default_rng(0)
    position = rng.standard_normal((PARTICLES, len(SPREAD))) * SPREAD
    velocity, best_cost = 0.3 * position[::-1], costs(position, OF)
    swarm = Swarm(position, velocity, position.copy(), best_cost)
    fly(swarm, OF, True, ITERATIONS - 1, rng)
    return float(swarm.best_cost.min())


def our_costs(positions: np.ndarray) -> np.ndarray:
    """Exoid's fitness for other optimisers, whose particles it must not move."""
    return costs(positions.copy(), OF)


def pyswarms_swarm(pyswarms, particles: int):
    """Return the same swarm of pyswarms: ring topology, the same coefficients of motion."""
    np.random.seed(0)  # noqa: NPY002  pyswarms draws from the global generator
    rng = np.random.default_rng(0)
    first = 0.1 * rng.standard_normal((particles, len(SPREAD))) * SPREAD
    first[:, -2:] += BOUNDS[0].mean(axis=1)
    options = {"c1": 1.49618, "c2": 1.49618, "w": 0.7298, "k": 3, "p": 2}
    return pyswarms.single.LocalBestPSO(particles, len(SPREAD), options=options, init_pos=first)


def until_goal(optimizer) -> float:
    """Let pyswarms go on until the goal or until patience ends."""
    start, best = time.process_time(), np.inf
    while best > GOAL and time.process_time() - start < PATIENCE_S:
        best = min(best, optimizer.optimize(our_costs, 100, verbose=False)[0])
    return float(best)


def fastest(work: Callable[[], object], rounds: int = 7) -> float:
    """Return the processor time of the fastest of several rounds, s."""
    return min(timed(work)[0] for _ in range(rounds))


def timed(work: Callable[[], float]) -> tuple[float, float]:
    """Return the processor time of one call and its value."""
    start = time.process_time()
    value = work()
    return time.process_time() - start, value


if __name__ == "__main__":
    show("exoid design", rows())
