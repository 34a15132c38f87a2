"""Search for an excitation: a swarm finds the region, an evolution strategy refines it."""

import time
from collections.abc import Callable

import numpy as np
from numpy.typing import NDArray
from scipy.linalg import null_space

from pipelines.design.evolution import polish
from pipelines.design.fitness import Problem, costs, expand, problem
from pipelines.design.lines import excited_lines
from pipelines.design.swarm import Swarm, fly
from pipelines.errors import NotIdentifiable
from pipelines.mechanics.fourier import FourierTrajectory
from pipelines.mechanics.geometry import Geometry
from pipelines.mechanics.limits import bounds_array
from pipelines.mechanics.trajectory import Trajectory
from pipelines.settings.design import DesignSettings

Report = Callable[[float, str], None]


def search(
    settings: DesignSettings, geometry: Geometry, report: Report = lambda done, note: None
) -> tuple[FourierTrajectory, str]:
    """Search for the excitation that is best by a criterion and keeps its bounds at every time.

    Parameters
    ----------
    settings : DesignSettings
        Bounds, criterion and effort.
    geometry : Geometry
        Lengths and gravity.
    report : callable
        Called with the share done, 0 to 1, and the best value so far.

    Returns
    -------
    trajectory : FourierTrajectory
        The best excitation.
    stopped_by : str
        ``stagnation``, ``iterations``, or ``seconds``; in the last case the result depends on the
        computer's speed.

    Raises
    ------
    NotIdentifiable
        If no motion within the bounds separates the parameters.
    """
    rng = np.random.default_rng(settings.seed)
    # The swarm only has to find the region. A coarse grid is five times as fast, and its bounds
    # are as strict.
    coarse = search_problem(settings, geometry, samples=200, samples_per_harmonic=40)
    fine = search_problem(settings, geometry, samples=1000, samples_per_harmonic=100)
    spread = spread_of(fine)

    def note(cost: float) -> str:
        return f"{settings.criterion} {-cost if settings.criterion == 'log_det' else cost:.4g}"

    swarm = first_swarm(settings, coarse, spread, rng)
    fly(swarm, coarse, True, 0, rng)  # Compiles before the search time begins.
    deadline = time.monotonic() + settings.seconds
    stopped_by = _let_fly(
        swarm, coarse, settings, rng, deadline, lambda done, cost: report(0.5 * done, note(cost))
    )

    # Arcs of the ring may be in different valleys, so the best particle of each is polished.
    arcs = 3
    best, best_cost = swarm.best_position[0], np.inf
    for i, arc in enumerate(np.array_split(np.arange(settings.particles), arcs)):
        start = swarm.best_position[arc[np.argmin(swarm.best_cost[arc])]]
        candidate, cost = polish(
            start,
            # The swarm has located the valley, so that the polish starts with small steps.
            0.05 * spread,
            lambda positions: costs(positions, fine),
            rng,
            out_of_time=lambda: time.monotonic() > deadline,
        )
        if cost < best_cost:
            best, best_cost = candidate, cost
        report(0.5 + 0.5 * (i + 1) / arcs, note(best_cost))
    if not np.isfinite(best_cost):
        raise NotIdentifiable(
            "no excitation within the bounds separates the parameters; widen [design.bounds] or"
            " add harmonics"
        )
    return trajectory_of(best, fine), "seconds" if time.monotonic() > deadline else stopped_by


def search_problem(
    settings: DesignSettings, geometry: Geometry, samples: int, samples_per_harmonic: int
) -> Problem:
    """Return the constants of a search.

    Parameters
    ----------
    settings : DesignSettings
        Bounds, harmonics and criterion.
    geometry : Geometry
        Lengths and gravity.
    samples, samples_per_harmonic : int
        Least number of samples a period, in all and for each harmonic.
    """
    return problem(
        omega=2.0 * np.pi * settings.base_frequency_hz,
        harmonics=settings.harmonics,
        bounds=bounds_array(settings.bounds),
        geometry=geometry,
        # A multisine has no search of its own over its coefficients.
        criterion="log_det" if settings.criterion == "multisine" else settings.criterion,
        theta0=None if settings.theta0_rad == "free" else np.array(settings.theta0_rad),
        basis=_basis(settings),
        # The bound between samples costs 0.3 % of the amplitude at 40 samples per harmonic. At 100
        # it costs 0.05 %.
        samples=max(samples, samples_per_harmonic * settings.harmonics),
    )


def _basis(settings: DesignSettings) -> NDArray:
    """Return the basis of the coefficients that the settings allow, (2, n, free)."""
    if settings.criterion != "multisine":
        return basis_of(settings.harmonics, settings.rest_to_rest)
    # A further experiment has the same detection lines as the designed one.
    lines = excited_lines(settings.harmonics, settings.seed)
    return np.array([np.eye(settings.harmonics)[:, lines - 1]] * 2)


def basis_of(harmonics: int, rest_to_rest: bool) -> NDArray:
    """Return the basis of the coefficients.

    At t = 0 and after each period, the velocity is w sum k a_k and the acceleration is -w² sum k²
    b_k. Both vanish at rest, so that the coefficients lie in the null spaces of (k) and (k²).

    Parameters
    ----------
    harmonics : int
        Number of harmonics, n.
    rest_to_rest : bool
        Whether each period begins and ends at rest.

    Returns
    -------
    (2, n, free) array
        Of sine (0) and cosine (1).
    """
    if not rest_to_rest:
        return np.array([np.eye(harmonics)] * 2)
    k = np.arange(1.0, harmonics + 1)
    return np.array([null_space(k[np.newaxis]), null_space(k[np.newaxis] ** 2)])


def spread_of(problem: Problem) -> NDArray:
    """Return the greatest value of each single coordinate within the bounds.

    Parameters
    ----------
    problem : Problem
        Bounds, rad, rad/s and rad/s².

    Returns
    -------
    (D,) array
        rad.
    """
    half = 0.5 * (problem.bounds[:, :, 1] - problem.bounds[:, :, 0])
    # An angle of amplitude A at frequency w has the velocity w A and the acceleration w² A.
    powers = problem.speeds ** np.arange(3)[:, np.newaxis]
    # A coordinate alone reaches the tightest of its three bounds first.
    reach = (half[:, :, np.newaxis] / powers[:, np.newaxis, :]).min(axis=0)
    coordinates = np.einsum("pkf,jk->pjf", np.abs(problem.basis), reach).ravel()
    return np.append(coordinates, half[0]) if problem.theta0_is_free else coordinates


def first_swarm(
    settings: DesignSettings, problem: Problem, spread: NDArray, rng: np.random.Generator
) -> Swarm:
    """Return random particles that keep all bounds.

    Parameters
    ----------
    settings : DesignSettings
        Number of particles.
    problem : Problem
        Bounds.
    spread : (D,) array
        Standard deviation of each coordinate, ``spread_of``.
    rng : Generator
        Random numbers.
    """
    shape = (settings.particles, len(spread))
    # Most of these break a bound; their repair puts them onto the bounds.
    position = rng.standard_normal(shape) * spread
    if problem.theta0_is_free:
        low, high = problem.bounds[0].T
        position[:, -2:] = rng.uniform(low, high, size=(settings.particles, 2))
    velocity = 0.3 * rng.standard_normal(shape) * spread
    # This repairs the positions in place.
    best_cost = costs(position, problem)
    return Swarm(position, velocity, position.copy(), best_cost)


def _let_fly(
    swarm: Swarm,
    problem: Problem,
    settings: DesignSettings,
    rng: np.random.Generator,
    deadline: float,
    report: Callable[[float, float], None],
) -> str:
    """Move the swarm until it stagnates, and return the reason for the end."""
    iterations_per_check = 25
    # Checks without this relative gain after which the swarm stops.
    patience, least_gain = 8, 1e-4
    best, last_gain = swarm.best_cost.min(), 0
    checks = -(-settings.iterations // iterations_per_check)
    for check in range(checks):
        fly(swarm, problem, settings.topology == "ring", iterations_per_check, rng)
        lowest = swarm.best_cost.min()
        # The right side is NaN while best is infinite, and then any cost is a gain.
        if not lowest >= best - least_gain * abs(best):
            best, last_gain = lowest, check
        report((check + 1) / checks, lowest)
        if time.monotonic() > deadline:
            return "seconds"
        if check - last_gain >= patience:
            return "stagnation"
    return "iterations"


def trajectory_of(candidate: NDArray, problem: Problem) -> FourierTrajectory:
    """Return the excitation that a candidate (D,) of a search is."""
    coefficients = np.empty((2, 2, len(problem.speeds)))
    expand(candidate, problem, coefficients)
    theta0 = candidate[-2:] if problem.theta0_is_free else problem.theta0
    return FourierTrajectory(
        theta0.copy(), coefficients[0], coefficients[1], float(problem.speeds[0])
    )


def candidate_of(trajectory: Trajectory, problem: Problem) -> NDArray | None:
    """Return the candidate (D,) whose excitation comes closest to a trajectory.

    None where it is no Fourier series of the search's frequencies.
    """
    speeds = problem.speeds
    if not isinstance(trajectory, FourierTrajectory) or trajectory.a.shape != (2, len(speeds)):
        return None
    if not np.isclose(trajectory.omega, speeds[0]):
        return None
    parts = zip((trajectory.a, trajectory.b), problem.basis, strict=True)
    coordinates = np.concatenate([(part @ basis).ravel() for part, basis in parts])
    return np.append(coordinates, trajectory.theta0) if problem.theta0_is_free else coordinates
