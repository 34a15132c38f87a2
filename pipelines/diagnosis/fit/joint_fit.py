"""The extended model: baseline and causes fitted together, shapes refined, uncertainty honest."""

import itertools
from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray
from scipy.optimize import minimize_scalar

from pipelines.diagnosis.candidates.candidate import ALWAYS, NEVER, Candidate, lowest
from pipelines.diagnosis.evidence.baseline import Baseline, with_load
from pipelines.diagnosis.evidence.baseline_columns import columns_under, gram_of_runs
from pipelines.diagnosis.evidence.gram import Gram, error, solve
from pipelines.diagnosis.evidence.observed_run import Run
from pipelines.diagnosis.fit.change_point import Onset
from pipelines.effects import Effect, Parameter, Side
from pipelines.effects.friction import Friction
from pipelines.mechanics.geometry import Geometry
from pipelines.model import Column, ParameterLayout, TermColumns

SWEEPS = 2
EVALUATIONS = 14
"""Of the fit along one shape parameter and sweep."""
STEPS_ON, AT_AN_END = 3, 0.05
"""How often a search that ended at an end of its range goes on from there, and what share of the range is its end."""
CLOSER = 0.25
"""Of its reach the second sweep looks, and so much more finely."""
MAXIMA_APART = {"Hz": 0.01, "1/turn": 1.0, "rad/m": 1.0}
"""How far apart the maxima of an oscillating effect are, in its parameter's grain, by its unit: the scan has found
the right one."""
BEYOND = 5.0
"""Times what is typical, from which an amplitude is doubted."""
MOST_OF_ALL = 0.5
"""Share of all of a joint's torque above which such an amplitude only stands because something else takes it away."""
UNGROUNDED = 0.1
"""Share of an excess of friction by which the level below it may come out negative, as its form's misfit lets it."""
SURE, ALIKE = 2.0, 6.0
"""Standard errors by which it must, and blocks that are one piece of news."""
UNREAL = 0.02
"""Share of a rigid body's largest inertia by which its least may come out negative, as its causes' misfit lets it."""
NEWTON_STEPS = 3
"""Of Gauss and Newton along what bends each run in its own way, which the torque is nearly linear in."""
STEP = 0.01
"""Of a difference along a shape parameter, as a share of its typical range."""
REACH = 1.6
"""How far a sweep looks from where a shape parameter stands, as a factor or a share of its range."""


@dataclass(frozen=True)
class Fit:
    """A set of causes fitted to some runs."""

    causes: tuple[Candidate, ...]
    values: NDArray
    """(size + linear parameters of the causes,)."""
    weights: NDArray
    """(O,) inverse variances under this fit."""
    rms: NDArray
    """(O,) N·m on what was fitted."""
    cost: float
    """Sum over outputs of samples times log rms: what refinement lowers."""
    layout: ParameterLayout
    """Of the values: the baseline's terms, then the causes."""
    shares: NDArray
    """(O, size + ...) what each column carries, rms, of all that was measured at an output."""
    normal: NDArray
    """(size + ..., size + ...) of the fit, outputs weighed by their inverse variances."""
    loads: NDArray | None = None
    """Values (size + ...,) whose bodies the loads in the runs are computed from, where not those the runs came with."""

    def absurdity(self, baseline: Baseline, geometry: Geometry) -> str:
        """Return why no machine or person has the causes as they were fitted; empty where one may.

        An amplitude beyond any that carries most of a joint's torque imitates what it is not, with others that take
        most of it away again; where a joint's torques are large themselves it means little. So does an excess of
        friction over a level that gives energy: another law of the speed bends like both together. And causes beside
        which no mass moves as the rigid body does have taken a part of it for something else.
        """
        most = self.shares.max(axis=0)
        for place, (effect, parameter, _) in self._amplitudes(baseline):
            amplitude = abs(self.values[place])
            if amplitude > BEYOND * max(map(abs, parameter.typical)) and most[place] > MOST_OF_ALL:
                return f"the {parameter.name} of {effect.label} is beyond any, and others take most of it away again"
            if effect.excess_over and self._gives_energy(effect, amplitude, baseline):
                return f"{effect.label} is an excess over friction that gives energy"
        return "beside them the rigid body is none that a machine has" if self._unreal(baseline, geometry) else ""

    def _unreal(self, baseline: Baseline, geometry: Geometry) -> bool:
        """Tell whether the machine, or machine and person together, plainly have a least inertia below nought."""
        inverse = np.linalg.pinv(self.normal, hermitian=True)
        for number in range(1, len(self.layout.bodies) + 1):
            bodies = self.layout.bodies[:number]
            X = self.values[bodies].sum(axis=0)
            least, largest, slope = baseline.machine.mechanism.least_inertia(X, geometry)
            along, own = np.tile(slope, len(bodies)), bodies.ravel()
            spread = np.sqrt(ALIKE * along @ inverse[np.ix_(own, own)] @ along)
            if -least > max(UNREAL * largest, SURE * spread):
                return True
        return False

    def _gives_energy(self, effect: Effect, amplitude: float, baseline: Baseline) -> bool:
        """Tell whether the level that an effect is an excess over is plainly negative, with what else rubs there."""
        place = self.layout.column_of(Friction.name, effect.joint, effect.excess_over)
        j = baseline.joints.index(str(effect.joint))
        level, carried = self.values[place], self.shares[j, place]
        others = [
            self.shares[j, column]
            for column, (other, *_) in self._amplitudes(baseline)
            if other.joint == effect.joint and other.name != effect.name and (other.dissipative or other.holds)
        ]
        if level >= 0.0 or carried <= sum(others):
            return False
        spread = np.sqrt(ALIKE * np.linalg.pinv(self.normal, hermitian=True)[place, place])
        lacking = -level * (1.0 - sum(others) / carried)
        return bool(lacking > max(UNGROUNDED * amplitude, SURE * spread))

    def _amplitudes(self, baseline: Baseline) -> Iterator[tuple[int, Column]]:
        """Yield place and meaning of each column that is the amplitude of a cause."""
        yield from itertools.islice(enumerate(self.layout.columns), baseline.size, None)

    def instead(self, number: int, cause: Candidate) -> list[Candidate]:
        """Return the causes with another in the place of one."""
        return [cause if k == number else c for k, c in enumerate(self.causes)]

    def columns_of(self, number: int) -> TermColumns:
        """Return the columns of a cause in ``values``, and the runs in which it acts."""
        return self.layout.terms[len(self.layout.terms) - len(self.causes) + number]


def fit(
    causes: Sequence[Candidate], runs: Sequence[Run], baseline: Baseline, weights: NDArray, loads: NDArray | None = None
) -> Fit:
    """Fit baseline and causes at the shapes they have, to runs with the ``loads`` that ``Fit.loads`` tells of.

    ``weights`` (O,) are the outputs' inverse variances."""
    causes = tuple(sorted(causes, key=_last_sensors))
    gram = gram_of_runs(runs, *zip(*stacked_columns(causes, runs, baseline), strict=True))
    values = solve(gram, weights)
    found, rms, cost = _errors(gram, values)
    normal = np.einsum("o,oij->ij", found, gram.columns)
    layout = _layout(causes, runs, baseline)
    return Fit(causes, values, found, rms, cost, layout, _shares(gram, values), normal, loads)


def _shares(gram: Gram, values: NDArray) -> NDArray:
    squares = np.einsum("oii->oi", gram.columns) * values**2
    return np.sqrt(squares / np.maximum(gram.square, np.finfo(float).tiny)[:, np.newaxis])


def laden(runs: Sequence[Run], made: Fit, baseline: Baseline) -> list[Run]:
    """Return runs with the loads that a fit is for."""
    return list(runs) if made.loads is None else [with_load(run, baseline, made.loads) for run in runs]


def residuals_on(made: Fit, runs: Sequence[Run], baseline: Baseline) -> list[NDArray]:
    """Return what a fit leaves of each run that it was made on, (m, O) N·m."""
    columns = stacked_columns(made.causes, laden(runs, made, baseline), baseline)
    return [measured - c @ made.values for c, measured in columns]


def _last_sensors(cause: Candidate) -> bool:
    return cause.effect.side is Side.SENSOR


def _layout(causes: Sequence[Candidate], runs: Sequence[Run], baseline: Baseline) -> ParameterLayout:
    """Return the layout of the columns of baseline and causes in runs."""
    effects = (*baseline.effects, *(cause.effect for cause in causes))
    return ParameterLayout.of(effects, [run.motion.run for run in runs])


def stacked_columns(
    causes: Sequence[Candidate], runs: Sequence[Run], baseline: Baseline
) -> list[tuple[NDArray, NDArray]]:
    """Return columns (m, O, c) and measured torque (m, O) of each run, run-wise parameters in places of their own."""
    layout = _layout(causes, runs, baseline)
    made = (columns_under([c.term(r) for c in causes], run, baseline) for r, run in enumerate(runs))
    return [(layout.expand(columns, r), measured) for r, (columns, measured) in enumerate(made)]


def _errors(gram: Gram, values: NDArray) -> tuple[NDArray, NDArray, float]:
    count = gram.count
    there = count > 0
    squares = error(gram, values)
    rms = np.sqrt(squares / np.maximum(count, 1))
    weights = np.where(there, 1.0 / np.maximum(rms, 1e-6) ** 2, 0.0)
    return weights, rms, float(np.sum(count[there] * np.log(rms[there])))


def refined(causes: Sequence[Candidate], runs: Sequence[Run], baseline: Baseline, weights: NDArray) -> Fit:
    """Fit with every shape parameter at its best, one after the other; ``weights`` (O,) as in ``fit``."""
    best = fit(causes, runs, baseline, weights)
    for sweep in range(SWEEPS):
        if sweep and best.causes:
            # The bodies of the fit before were biased by what is missing, and so were the loads that bend and rub.
            loads = best.values
            runs = [with_load(run, baseline, loads) for run in runs]
            best = fit(best.causes, runs, baseline, weights, loads)
        best = _bent_each_run(best, runs, baseline, weights)
        for number, cause in enumerate(best.causes):
            for i, parameter in enumerate(cause.effect.shape):
                if parameter.forms and cause.bends and cause.effect.swings:
                    best = _best_form(best, number, i, runs, baseline, weights)
                if parameter.forms or parameter.default is not None or i == cause.own_bend:
                    continue
                if i == cause.onset:
                    best = _begun(best, number, i, runs, baseline, weights)
                else:
                    best = _along(best, number, i, runs, baseline, weights, sweep)
    return best


def _begun(best: Fit, number: int, i: int, runs: Sequence[Run], baseline: Baseline, weights: NDArray) -> Fit:
    """Move the instant at which a cause begins in each run to where it explains most, all else held."""
    acting, found = best.columns_of(number).runs, onsets_of(best, number, i, runs, baseline)
    instants = [found[r].likeliest if r in acting else shape[i] for r, shape in enumerate(best.causes[number].shapes)]
    causes = best.instead(number, best.causes[number].with_own(i, instants))
    return min((best, fit(causes, runs, baseline, weights, best.loads)), key=lambda f: f.cost)


def onsets_of(made: Fit, number: int, i: int, runs: Sequence[Run], baseline: Baseline) -> list[Onset]:
    """Return for each run when a cause may begin in it by its shape parameter ``i``, all else as it was fitted."""
    ends = [made.instead(number, made.causes[number].reshaped(i, end)) for end in (NEVER, ALWAYS)]
    without, throughout = (
        [measured - columns @ made.values for columns, measured in stacked_columns(causes, runs, baseline)]
        for causes in ends
    )
    return [
        Onset.of(run, never, always, run.usable, made.weights)
        for run, never, always in zip(runs, without, throughout, strict=True)
    ]


def _bent_each_run(best: Fit, runs: Sequence[Run], baseline: Baseline, weights: NDArray) -> Fit:
    """Improve the shape parameters by which causes bend each run in a way of its own: all at once, in all runs."""
    places = [(number, i) for number, cause in enumerate(best.causes) if (i := cause.own_bend) is not None]
    if not places:
        return best
    straight = list(best.causes)
    for number, i in places:
        straight[number] = straight[number].reshaped(i, straight[number].effect.shape[i].neutral)
    tried = [best, fit(straight, runs, baseline, weights, best.loads)]
    made = min(tried, key=lambda f: f.cost)
    for _ in range(NEWTON_STEPS):
        made = fit(_stepped(made, places, runs, baseline, weights), runs, baseline, weights, best.loads)
        tried.append(made)
    return min(tried, key=lambda f: f.cost)


def _stepped(
    made: Fit, places: Sequence[tuple[int, int]], runs: Sequence[Run], baseline: Baseline, weights: NDArray
) -> list[Candidate]:
    """Return a fit's causes after a step of Gauss and Newton along shapes (cause, parameter) that each run has."""
    plain = stacked_columns(made.causes, runs, baseline)
    wide = [[columns] for columns, _ in plain]
    for number, i in places:
        own = TermColumns.of(made.causes[number].effect, made.layout.kinds, [True])
        for r, slope_in_run in enumerate(slope(made, (number, i, -1), runs, baseline, plain)):
            wide[r].append(own.expand(slope_in_run[:, :, np.newaxis], r))
    gram = gram_of_runs(runs, [np.concatenate(parts, axis=2) for parts in wide], [y for _, y in plain])
    steps = iter(solve(gram, weights)[len(made.values) :])
    causes = list(made.causes)
    for number, i in places:
        cause, values = causes[number], [shape[i] for shape in causes[number].shapes]
        for r, run in enumerate(runs):
            if cause.effect.explains(run.motion):
                values[r] = within_reach(values[r] + next(steps), cause.effect.shape[i])
        causes[number] = cause.with_own(i, values)
    return causes


def slope(
    made: Fit, place: tuple[int, int, int], runs: Sequence[Run], baseline: Baseline,
    plain: Sequence[tuple[NDArray, NDArray]],
) -> list[NDArray]:  # fmt: skip
    """Return what a shape does to the prediction, per unit of it, (m, O) of each run.

    ``place`` is (cause, shape parameter, run), run -1 for all; ``plain`` are the fit's own columns and torques.
    """
    number, i, run = place
    cause = made.causes[number]
    step = step_of(cause, i, max(run, 0))
    moved = cause.moved(i, step, None if run < 0 else [run])
    ahead = stacked_columns(made.instead(number, moved), runs, baseline)
    return [((c @ made.values - y) - (d @ made.values - z)) / step for (c, y), (d, z) in zip(ahead, plain, strict=True)]


def step_of(cause: Candidate, i: int, run: int = 0) -> float:
    """Return the step of a difference along a shape parameter, as large as in one run its value asks for."""
    low, high = cause.effect.shape[i].typical
    return STEP * (abs(cause.shapes[run][i]) if low > 0 and high / low > 4 else high - low)


def within_reach(value: float, parameter: Parameter) -> float:
    """Return the value that a fit may give to a shape parameter of either sign, as near as it may come to ``value``."""
    return float(np.clip(value, *_farthest(parameter)))


def _farthest(parameter: Parameter) -> tuple[float, float]:
    """Return the least and the largest value that a fit may give to a shape parameter of either sign."""
    low, high = parameter.typical
    beyond = 0.5 * (high - low)
    return low - beyond, high + beyond


def _best_form(best: Fit, number: int, i: int, runs: Sequence[Run], baseline: Baseline, weights: NDArray) -> Fit:
    """Try the other forms of one cause."""
    cause = best.causes[number]
    tried = [best]
    for form in cause.effect.shape[i].forms:
        if form == cause.shapes[0][i]:
            continue
        tried.append(fit(best.instead(number, cause.reshaped(i, form)), runs, baseline, weights, best.loads))
    return min(tried, key=lambda f: f.cost)


def _along(
    best: Fit, number: int, i: int, runs: Sequence[Run], baseline: Baseline, weights: NDArray, sweep: int
) -> Fit:
    """Improve one shape parameter of one cause; where the best lies at an end, look on from there."""
    effect = best.causes[number].effect
    parameter, least = effect.shape[i], lowest(effect, effect.shape[i], runs)
    for _ in range(STEPS_ON):
        now = best.causes[number].shapes[0][i]
        to_value, low, high = _scale(parameter, now, 1.0 if sweep == 0 else CLOSER, least)
        if not low < high:
            break
        best = _between(best, number, i, runs, baseline, weights, (to_value, low, high))
        found = best.causes[number].shapes[0][i]
        at_an_end = any(
            abs(found - to_value(end)) < AT_AN_END * abs(to_value(high) - to_value(low)) for end in (low, high)
        )
        if not at_an_end or found == now:
            break
    return best


def _between(
    best: Fit, number: int, i: int, runs: Sequence[Run], baseline: Baseline, weights: NDArray,
    scale: tuple[Callable[[float], float], float, float],
) -> Fit:  # fmt: skip
    """Return the best of the fits that a bounded search along one shape parameter tries."""
    to_value, low, high = scale
    tried: list[Fit] = [best]

    def cost(x: float) -> float:
        causes = best.instead(number, best.causes[number].reshaped(i, to_value(x)))
        tried.append(fit(causes, runs, baseline, weights, best.loads))
        return tried[-1].cost

    minimize_scalar(
        cost, bounds=(low, high), method="bounded", options={"maxiter": EVALUATIONS, "xatol": 0.02 * (high - low)}
    )
    return min(tried, key=lambda f: f.cost)


def _scale(
    parameter: Parameter, now: float, share: float, least: float
) -> tuple[Callable[[float], float], float, float]:
    """Return how a search coordinate becomes a value, and its range: near by, and hardly beyond typical.

    ``share`` of the usual reach; of what oscillates, no lower than ``least``.
    """
    low, high = parameter.typical
    if parameter.unit in MAXIMA_APART:
        reach = share * parameter.grain * MAXIMA_APART[parameter.unit]
        return float, max(now - reach, least), now + reach
    if low > 0 and high / low > 4:
        reach = share * 2 * float(np.log(REACH))
        bottom = min(max(np.log(now) - reach, np.log(low / REACH)), np.log(now))
        return lambda x: float(np.exp(x)), bottom, max(min(np.log(now) + reach, np.log(high * REACH)), np.log(now))
    reach, (least, largest) = share * 0.25 * (high - low), _farthest(parameter)
    return float, min(max(now - reach, least), now), max(min(now + reach, largest), now)
