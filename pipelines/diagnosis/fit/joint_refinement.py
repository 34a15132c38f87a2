"""Refine all shapes of a set of causes together, at full rate, by Gauss and Newton's method.

Each step solves for amplitudes and shapes at once, along the slopes of the prediction, and is
halved until it lowers the cost. Onsets are found exactly between steps.
"""

from collections.abc import Sequence

import numpy as np
from numpy.typing import NDArray

from pipelines.diagnosis.candidates.candidate import Candidate, lowest
from pipelines.diagnosis.candidates.shape_refinement import changed, free_shapes, unit_of_change
from pipelines.diagnosis.evidence.baseline import Baseline, relaxed, with_load
from pipelines.diagnosis.evidence.baseline_columns import gram_of_runs
from pipelines.diagnosis.evidence.gram import solve
from pipelines.diagnosis.evidence.observed_run import Run
from pipelines.diagnosis.fit.joint_fit import Fit, fit, onsets_of, slope, stacked_columns

Place = tuple[int, int, int, float]
"""Cause, shape parameter, run (-1 where runs share it), and its unit of change."""


class Refinement:
    """Refines the shapes of one set of causes on the fitted runs."""

    def __init__(self, runs: Sequence[Run], baseline: Baseline, weights: NDArray) -> None:
        """Prepare; ``weights`` (O,) are the outputs' inverse variances, 1/(N·m)²."""
        self._runs, self._baseline, self._weights = runs, baseline, weights

    def __call__(self, causes: Sequence[Candidate]) -> Fit:
        """Return the fit with every shape at its best."""
        start = self._start(causes)
        # A swinging load is simulated with the rigid bodies of the fit itself. Where these do not
        # converge, and the cause would do harm, it is simulated with those of the library: the fit
        # may then predict other runs badly.
        still = [cause for cause in causes if not cause.effect.swings]
        if len(still) < len(causes):
            settled = self._at_rest(self._refined(self._at_rest(start)))
            if settled.cost < self._fit(still, self._runs, None).cost:
                return settled
        return self._refined(start)

    def _at_rest(self, best: Fit) -> Fit:
        """Return the fit at the same shapes with joint loads of its own rigid bodies."""
        # Five steps converge, each half way to the refitted bodies.
        for _ in range(5):
            loads = self._loads_after(best)
            best = self._fit(best.causes, self._with_loads(loads), loads)
        return best

    def _refined(self, best: Fit) -> Fit:
        """Return the best fit of some rounds from a start."""
        fits = [best]
        # Relative fall of the cost below which a round has converged.
        enough = 1e-4
        for _ in range(3 if best.causes else 0):
            # Without this cause the fit's bodies were biased, and so were the loads.
            loads = self._loads_after(best)
            runs = self._with_loads(loads)
            start = self._fit(best.causes, runs, loads)
            ahead = self._stepped(self._forms(start, runs), runs)
            fits.append(ahead)
            if ahead.cost > best.cost - enough * abs(best.cost):
                break
            best = ahead
        return min(fits, key=lambda one: one.cost)

    def _start(self, causes: Sequence[Candidate]) -> Fit:
        """Return the fit of the shapes as they are, with the library's rigid bodies."""
        # A machine has one set of bodies, so those of the first transmission count.
        bodies = next((cause.bodies for cause in causes if cause.bodies), None)
        if bodies is None:
            return self._fit(causes, self._runs, None)
        loads = np.array(bodies)
        return self._fit(causes, self._with_loads(loads), loads)

    def _loads_after(self, best: Fit) -> NDArray:
        """Return baseline values (size,) whose bodies make the loads of the next round."""
        size = self._baseline.size
        return relaxed(best.values[:size], None if best.loads is None else best.loads[:size])

    def _with_loads(self, loads: NDArray) -> list[Run]:
        """Return the runs with the loads of the rigid bodies in a fit's values."""
        return [with_load(run, self._baseline, loads) for run in self._runs]

    def _fit(self, causes: Sequence[Candidate], runs: Sequence[Run], loads: NDArray | None) -> Fit:
        return fit(causes, runs, self._baseline, self._weights, loads)

    def _stepped(self, best: Fit, runs: Sequence[Run]) -> Fit:
        """Return the fit after a few steps of its shapes, its forms unchanged."""
        for _ in range(3):
            best = self._onsets(best, runs)
            ahead = self._step(best, runs)
            if ahead is None:
                break
            best = ahead
        return best

    def _forms(self, best: Fit, runs: Sequence[Run]) -> Fit:
        """Return the best fit of all that change the form of one cause, shapes refined.

        The library chose forms at the rate of the decision band, and a transmission's is always
        straight. With the other causes, and in shorter blocks, another form may be the best.
        """
        tried = [best]
        for number, cause in enumerate(best.causes):
            for i, parameter in enumerate(cause.effect.shape):
                for form in parameter.forms:
                    if form != cause.shapes[0][i]:
                        causes = best.instead(number, cause.reshaped(i, form))
                        tried.append(self._fit(causes, runs, best.loads))
        # Forms compete at their own best shapes, not at those of the present form.
        if len(tried) > 1:
            tried = [self._stepped(one, runs) for one in tried]
        return min(tried, key=lambda one: one.cost)

    def _onsets(self, best: Fit, runs: Sequence[Run]) -> Fit:
        """Move onsets to the instants at which they explain most, all else held."""
        for number, cause in enumerate(best.causes):
            i = cause.onset
            if i is None:
                continue
            onsets = onsets_of(best, number, i, runs, self._baseline)
            acting = best.columns_of(number).runs
            instants = [
                onsets[r].likeliest if r in acting else shape[i]
                for r, shape in enumerate(cause.shapes)
            ]
            causes = best.instead(number, cause.with_own(i, instants))
            # The likeliest instant prefers a simple answer, which may cost a little more than now.
            best = min((best, self._fit(causes, runs, best.loads)), key=lambda one: one.cost)
        return best

    def _step(self, best: Fit, runs: Sequence[Run]) -> Fit | None:
        """Return the fit after one step that lowers the cost; None if no step does."""
        places = self._places(best)
        if not places:
            return None
        plain = stacked_columns(best.causes, runs, self._baseline)
        slopes = [slope(best, place[:3], runs, self._baseline, plain) for place in places]
        wide = [
            np.concatenate([columns, np.stack([s[r] for s in slopes], axis=2)], axis=2)
            for r, (columns, _) in enumerate(plain)
        ]
        gram = gram_of_runs(runs, wide, [measured for _, measured in plain])
        # Only the steps of shapes are used: amplitudes are fitted again at each length.
        steps = solve(gram, self._weights)[len(best.values) :]
        # The step is halved until it gains.
        length = 1.0
        for _ in range(3):
            causes = _moved(best.causes, places, length * steps, runs)
            ahead = self._fit(causes, runs, best.loads)
            if ahead.cost < best.cost:
                return ahead
            length *= 0.5
        return None

    def _places(self, fitted: Fit) -> list[Place]:
        """Return the free shapes; a per-run shape has one for each run."""
        places: list[Place] = []
        for number, cause in enumerate(fitted.causes):
            for i, unit in free_shapes(cause):
                own = i == cause.per_run_transform
                # A run in which the cause does not act has no slope, and no shape to fit.
                acting = fitted.columns_of(number).runs if own else (-1,)
                places += [(number, i, run, unit) for run in acting]
        return places


def _moved(
    causes: Sequence[Candidate], places: Sequence[Place], steps: NDArray, runs: Sequence[Run]
) -> list[Candidate]:
    """Return the causes after steps of their shapes, in units of the shapes.

    No wave becomes longer than the runs can separate from a law of the angle.
    """
    moved = list(causes)
    for (number, i, run, unit), step in zip(places, steps, strict=True):
        of_unit = step / unit_of_change(moved[number], i, unit, max(run, 0))
        acting = None if run < 0 else [run]
        ahead = changed(moved[number], i, unit, of_unit, acting)
        effect, value = ahead.effect, ahead.shapes[max(run, 0)][i]
        least = lowest(effect, effect.shape[i], runs)
        moved[number] = ahead if value >= least else ahead.reshaped(i, least, acting)
    return moved
