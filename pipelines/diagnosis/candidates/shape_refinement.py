"""Refine the shape of one cause along its derivative, by Gauss and Newton's method.

A step solves for the amplitudes and the shape's change together, with the baseline and the other
causes of the set refitted. The derivative columns are kept: with them a set of causes can move
every shape a little without computing any column again.
"""

from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from pipelines.contracts.joint_units import unit_at
from pipelines.diagnosis.candidates.candidate import ALWAYS, NEVER, TURNS, Candidate
from pipelines.diagnosis.candidates.candidate_rows import CandidateRows
from pipelines.diagnosis.evidence.decision_regression import DecisionRegression
from pipelines.effects import Parameter

ONSETS = 40
"""Instants tried in a run at a time."""
TONE_STEP_HZ = 0.01
"""Unit of change of a rhythm's frequency: that of a line over 100 s, Hz."""


@dataclass(frozen=True)
class CandidateFit:
    """One candidate and how much it explains."""

    candidate: Candidate
    columns: NDArray
    """(N, k) rows."""
    amplitudes: NDArray
    """(k,) that explain most; for a candidate that transforms the motion, 1 at its true shape."""
    gain: float
    """Log likelihood over the baseline's, amplitudes free."""
    gain_as_is: float
    """The same with amplitude one, for a candidate that transforms the motion."""

    @property
    def score(self) -> float:
        """The gain by which shapes are compared."""
        # Another amplitude than one would scale the twist, and a swinging load does not follow it.
        return self.gain_as_is if self.candidate.effect.swings else self.gain

    @property
    def torque(self) -> NDArray:
        """Prediction of the candidate at its shape, (N,) rows."""
        transforms = self.candidate.transforms_motion and not self.candidate.directions
        amplitudes = np.ones_like(self.amplitudes) if transforms else self.amplitudes
        return self.columns @ amplitudes


class ShapeRefinement:
    """Fits single candidates together with the baseline, and with rows of other causes if given."""

    def __init__(
        self,
        rows: CandidateRows,
        regression: DecisionRegression,
        others: NDArray | None = None,
        enough: float = 0.2,
    ) -> None:
        """Prepare the projection.

        Parameters
        ----------
        rows : CandidateRows
        regression : DecisionRegression
        others : (N, b) array, optional
            Rows of other causes, fitted freely.
        enough : float, optional
            Log likelihood that a step must gain to be followed by another.
        """
        self._rows, self._regression, self._others = rows, regression, others
        self._enough = enough
        measured = regression.measured
        basis = np.zeros((len(measured), 0))
        if others is not None and others.shape[1]:
            basis, _ = np.linalg.qr(regression.project(others))
        self._basis = basis
        self._measured = measured - basis @ (basis.T @ measured)

    def _project(self, rows: NDArray) -> NDArray:
        """Return rows (N, k) less the baseline and the other causes; zero for rounding."""
        plain = self._regression.project(rows)
        plain -= self._basis @ (self._basis.T @ plain)
        size = np.linalg.norm(rows, axis=0)
        # Relative length below which a projected column is rounding error. What the baseline
        # explains but for rounding would get an enormous amplitude.
        rounding_error = 1e-5
        return np.where(np.linalg.norm(plain, axis=0) > rounding_error * size, plain, 0.0)

    def fit(self, candidate: Candidate) -> CandidateFit | None:
        """Fit a candidate's amplitudes; return None where its rows are not finite."""
        columns = self._rows(candidate, self._others)
        return None if columns is None else self._fitted(candidate, columns)

    def _fitted(self, candidate: Candidate, columns: NDArray) -> CandidateFit:
        """Fit the amplitudes of a candidate's columns (N, k)."""
        plain = self._project(columns)
        amplitudes, gain = _solved(plain, self._measured)
        as_is = gain
        if candidate.transforms_motion and not candidate.directions:
            # At amplitude one the torque is that of this very shape, at another of no effect.
            remainder = self._measured - plain.sum(axis=1)
            as_is = 0.5 * float(self._measured @ self._measured - remainder @ remainder)
        return CandidateFit(candidate, columns, amplitudes, gain, as_is)

    def best_of(self, fits: Sequence[CandidateFit]) -> CandidateFit | None:
        """Return the fit of an effect that explains most here, from fits made elsewhere."""
        # The best instants depend on the part that other causes explain, so they are sought again.
        if fits[0].candidate.onset is not None:
            return self._with_onsets(fits[0].candidate)
        # Only amplitudes are fitted again: new rows would cost as much as the coarse search.
        return max(
            (self._fitted(f.candidate, f.columns) for f in fits), key=lambda fitted: fitted.score
        )

    def refined(self, start: CandidateFit) -> tuple[CandidateFit, NDArray]:
        """Return the candidate at its best shape.

        A transmission's rigid bodies and shapes are fitted in turn. Either may come first, because
        there are several maxima. A refit of the bodies that does not explain more is left out.

        Parameters
        ----------
        start : CandidateFit
            Where to start.

        Returns
        -------
        tuple
            The fit, and its derivative columns (N, d).
        """
        if not start.candidate.effect.swings:
            return self._refined(start)
        own = None if start.candidate.bodies else self.fit(self._with_own_bodies(start.candidate))
        starts = [start] if own is None else [start, own]
        best, slopes = max(map(self._refined, starts), key=lambda pair: pair[0].score)
        for _ in range(2):
            ahead = self.fit(self._rows.with_refitted_bodies(best.candidate, self._others))
            refined = None if ahead is None else self._refined(ahead)
            if refined is None or refined[0].score < best.score + self._enough:
                break
            best, slopes = refined
        return best, slopes

    def _refined(self, start: CandidateFit) -> tuple[CandidateFit, NDArray]:
        """Return the candidate's best shape with given rigid bodies, and slopes, (N, d)."""
        if start.candidate.directions:
            # Linear in its shapes: the amplitudes are the shape.
            return _shaped(start), np.zeros((len(self._measured), 0))
        if start.candidate.onset is not None:
            best = self._with_onsets(start.candidate)
            return (best or start), np.zeros((len(self._measured), 0))
        best, units = self._scaled(start), free_shapes(start.candidate)
        slopes, most_steps = self._slopes(best, units), 3
        for _ in range(most_steps if units else 0):
            ahead = self._step(best, slopes, units)
            if ahead is None:
                break
            enough = ahead.gain_as_is > best.gain_as_is + self._enough
            best = ahead
            slopes = self._slopes(best, units)
            if not enough:
                break
        return best, slopes

    def fits_of_transmission(self, candidate: Candidate) -> list[CandidateFit]:
        """Fit a transmission with the baseline's bodies, and with refitted ones.

        A fit whose rows are not finite is left out.
        """
        fits = [self.fit(candidate), self.fit(self._with_own_bodies(candidate))]
        return [fitted for fitted in fits if fitted is not None]

    def _with_own_bodies(self, candidate: Candidate) -> Candidate:
        """Return a transmission with rigid bodies refitted at its shape."""
        for _ in range(2):
            candidate = self._rows.with_refitted_bodies(candidate, self._others)
        return candidate

    def _with_onsets(self, candidate: Candidate) -> CandidateFit | None:
        """Return a candidate whose onset in each run is the instant at which it explains most.

        It never begins in a run where that explains as much. Its amplitude is the same in all runs.
        After its onset an effect acts as if it had always been present: the column of an instant is
        that of the whole run, zero before it.
        """
        # Coordinate search: the best instant of one run at a time, those of the others held. The
        # amplitude is common, so the runs cannot be searched apart.
        at, count = candidate.onset, len(candidate.shapes)
        assert at is not None
        times = {r: self._regression.time[self._regression.run == r] for r in range(count)}
        times = {r: t for r, t in times.items() if len(t)}  # a run may have no row with weight
        whole = {r: self._only_in(candidate, r) for r in times}
        steps = {r: (t.max() - t.min()) / ONSETS for r, t in times.items()}
        onsets, own = [NEVER] * count, {r: np.zeros(len(self._measured)) for r in times}
        for sweep in range(3):
            for r, t in times.items():
                # After the first sweep an onset is sought within one step of its last place. A run
                # without one is searched as a whole again, as the amplitude may have changed.
                fine = sweep > 0 and onsets[r] != NEVER
                ends = (
                    (onsets[r] - steps[r], onsets[r] + steps[r])
                    if fine
                    else (t.min(), t.max() - steps[r])
                )
                instants = np.linspace(*ends, ONSETS + int(fine))
                others = (
                    np.sum([own[k] for k in times if k != r], axis=0)
                    if len(times) > 1
                    else np.zeros_like(own[r])
                )
                begun = whole[r][:, np.newaxis] * (self._regression.time[:, np.newaxis] >= instants)
                columns = self._project(begun)
                gains = self._gains(others[:, np.newaxis] + columns)
                best = int(np.argmax(gains))
                # The best of so many instants gains by chance: about the logarithm of their number.
                worth = gains[best] > self._gains(others[:, np.newaxis])[0] + np.log(ONSETS)
                onsets[r] = float(instants[best]) if worth else NEVER
                own[r] = columns[:, best] * worth
        return self.fit(candidate.with_own(at, onsets))

    def _only_in(self, candidate: Candidate, number: int) -> NDArray:
        """Return the rows (N,) of a candidate that acts in one run only, from its start on."""
        at, runs = candidate.onset, range(len(candidate.shapes))
        assert at is not None
        alone = candidate.with_own(at, [ALWAYS if k == number else NEVER for k in runs])
        rows = self._rows(alone, self._others)
        return np.zeros(len(self._measured)) if rows is None else rows[:, 0]

    def _gains(self, plain: NDArray) -> NDArray:
        """Return the log likelihood that each projected column (N, k) gains alone, (k,)."""
        square = np.sum(plain**2, axis=0)
        return 0.5 * (plain.T @ self._measured) ** 2 / np.where(square > 0.0, square, np.inf)

    def _scaled(self, start: CandidateFit) -> CandidateFit:
        """Return a candidate that transforms the motion, its shape scaled by the amplitude."""
        # A small effect is nearly proportional to its shape, so its amplitude shows the shape to
        # try. A negative one shows none: it would be a negative delay or stiffness.
        effect, (amplitude, *others) = start.candidate.effect, start.amplitudes
        if not start.candidate.transforms_motion or others or amplitude <= 0.0:
            return start
        parameter, now = effect.shape[0], start.candidate.shapes[0][0]
        if parameter.by_factors:
            # The twist of a spring is proportional to its compliance, so a stiffness is divided.
            of_stiffness = {unit_at(kind, "N·m/rad") for kind in ("revolute", "prismatic")}
            value = now / amplitude if parameter.unit in of_stiffness else now * amplitude
        else:
            value = parameter.neutral + amplitude * (now - parameter.neutral)
        ahead = self.fit(
            self._following(start.candidate.reshaped(0, float(np.clip(value, *reach(parameter)))))
        )
        return start if ahead is None or ahead.gain_as_is < start.gain_as_is else ahead

    def _following(self, candidate: Candidate) -> Candidate:
        """Return a candidate at a new shape; a transmission with rigid bodies refitted to it."""
        return (
            self._rows.with_refitted_bodies(candidate, self._others)
            if candidate.bodies
            else candidate
        )

    def _slopes(self, fitted: CandidateFit, units: list[tuple[int, float]]) -> NDArray:
        """Return the change of the prediction by each free shape, per unit of change, (N, d)."""
        slopes = np.zeros((len(self._measured), len(units)))
        # Step of a difference quotient, in the shape's own unit of change.
        difference = 0.02
        for d, (i, unit) in enumerate(units):
            step = difference * unit_of_change(fitted.candidate, i, unit)
            moved = self._rows(fitted.candidate.moved(i, step), self._others)
            if moved is not None and moved.shape == fitted.columns.shape:
                # Amplitudes are held: this is the slope of the prediction, per unit of change.
                slopes[:, d] = replace(fitted, columns=moved - fitted.columns).torque / difference
        return slopes

    def _step(
        self, fitted: CandidateFit, slopes: NDArray, units: list[tuple[int, float]]
    ) -> CandidateFit | None:
        """Return the fit after one step along all free shapes; None where no step gains."""
        transforms = fitted.candidate.transforms_motion
        parts = [slopes] if transforms else [fitted.columns, slopes]
        plain = self._project(np.hstack(parts))
        # An effect that transforms the motion has no amplitude: its shape alone explains the rest.
        remainder = self._measured - self._project(fitted.columns).sum(axis=1) * transforms
        solution, _ = _solved(plain, remainder)
        # Only the slopes' coefficients are used: amplitudes are fitted again at each new shape.
        # Three lengths are tried, each 0.3 of the one before, until one gains.
        length = 1.0
        for _ in range(3):
            candidate = fitted.candidate
            steps = length * solution[len(solution) - len(units) :]
            for (i, unit), step in zip(units, steps, strict=True):
                candidate = changed(candidate, i, unit, float(step))
            ahead = self.fit(self._following(candidate))
            if ahead is not None and ahead.gain_as_is > fitted.gain_as_is:
                return ahead
            length *= 0.3
        return None


def _solved(rows: NDArray, target: NDArray) -> tuple[NDArray, float]:
    """Return coefficients (k,) of rows (N, k), and the log likelihood that they gain."""
    gram = rows.T @ rows
    size = np.sqrt(np.maximum(np.diag(gram), np.finfo(float).tiny))
    scaled = gram / np.outer(size, size) + 1e-9 * np.eye(len(size))
    right = rows.T @ target / size
    solution = np.linalg.solve(scaled, right)
    return solution / size, 0.5 * float(right @ solution)


def _shaped(fitted: CandidateFit) -> CandidateFit:
    """Return a candidate that is linear in its shapes, at the shape given by its amplitudes."""
    candidate = fitted.candidate
    directions = np.array(candidate.directions)
    # A form is no size, so amplitudes do not scale it.
    held = np.array([bool(parameter.forms) for parameter in candidate.effect.shape])
    shape = np.where(held, directions[0], fitted.amplitudes[: len(directions)] @ directions)
    shapes = (tuple(shape.tolist()),) * len(candidate.shapes)
    return replace(fitted, candidate=replace(candidate, shapes=shapes))


def has_shapes(candidate: Candidate) -> bool:
    """Return whether a candidate has a shape that other causes of its set may move."""
    return bool(free_shapes(candidate)) or candidate.onset is not None


def free_shapes(candidate: Candidate) -> list[tuple[int, float]]:
    """Return the shapes that are refined along their slopes, and the unit of change of each.

    The unit is zero where a shape changes by factors. Onsets are searched separately.
    """
    return [
        (i, _unit_of(parameter))
        for i, parameter in enumerate(candidate.effect.shape)
        if candidate.is_free(i) and i != candidate.onset
    ]


def _unit_of(parameter: Parameter) -> float:
    """Return a shape's unit of change: its grain, its range, or zero if it changes by factors."""
    low, high = parameter.typical
    # Along waves and tones the likelihood has many maxima: a step stays within one of them.
    if parameter.unit in TURNS:
        return parameter.grain
    if parameter.unit == "Hz":
        return TONE_STEP_HZ
    return 0.0 if parameter.by_factors else high - low


def log_searched(candidate: Candidate) -> float:
    """Return the log number of independent values tried for its waves, tones and onsets."""
    effect, count = candidate.effect, 0.0
    for i, parameter in enumerate(effect.shape):
        if i == candidate.onset:
            count += np.log(ONSETS) * sum(shape[i] < NEVER for shape in candidate.shapes)
        elif candidate.is_free(i) and parameter.unit in (*TURNS, "Hz"):
            count += np.log(np.ptp(parameter.typical) / _unit_of(parameter))
    return float(count)


def unit_of_change(candidate: Candidate, i: int, unit: float, run: int = 0) -> float:
    """Return the unit of change as a difference.

    Parameters
    ----------
    candidate : Candidate
        Its own shape is the scale of a change by factors.
    i : int
        Number of the shape.
    unit : float
        Unit of change; zero for a change by factors.
    run : int, optional
        Run whose shape is used.

    Returns
    -------
    float
        In the shape's unit.
    """
    return unit if unit else abs(candidate.shapes[run][i])


def changed(
    candidate: Candidate, i: int, unit: float, step: float, runs: Sequence[int] | None = None
) -> Candidate:
    """Return the candidate after a step, within reach of its typical range.

    Parameters
    ----------
    candidate : Candidate
        Where to step from.
    i : int
        Number of the shape.
    unit : float
        Unit of change; zero for a change by factors.
    step : float
        In units of change; a larger one than 0.7 either way is cut.
    runs : sequence of int, optional
        Runs that change; all by default.
    """
    parameter, now = candidate.effect.shape[i], candidate.shapes[runs[0] if runs else 0][i]
    # Largest change in one step, in the shape's unit of change.
    largest = 0.7
    # Slopes are local, and a full step may lead far beyond their validity.
    step = float(np.clip(step, -largest, largest))
    value = now + step * unit if unit else now * np.exp(step)
    return candidate.reshaped(i, float(np.clip(value, *reach(parameter))), runs)


def reach(parameter: Parameter) -> tuple[float, float]:
    """Return the least and the greatest value to which a shape is refined, in its unit."""
    low, high = parameter.typical
    if not _unit_of(parameter):
        # Factor by which a shape that changes by factors may leave its typical range.
        factor = 2.0
        return low / factor, high * factor
    # Share of its typical range by which any other shape may leave it.
    margin = 0.5
    beyond = margin * (high - low)
    if low >= 0.0:
        return max(low - beyond, 0.0), high + beyond  # a delay is never negative
    return low - beyond, high + beyond
