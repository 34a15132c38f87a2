"""The shape of one cause, refined by its derivative: Gauss and Newton's steps.

A step solves for the amplitudes and the shape's change together, with the baseline refitted. The derivative columns are kept: with them a set of causes can move every shape a
little without computing any column anew.
"""

from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from pipelines.diagnosis.candidates.candidate import TURNS, Candidate
from pipelines.effects import Parameter

STEPS = 3
"""Steps at most."""
ENOUGH = 0.2
"""Log likelihood that a step must gain to be followed by another."""
DIFFERENCE = 0.02
"""Step of a difference quotient, in the shape's own unit of change."""
LARGEST_STEP = 0.7
"""Of one step, in the shape's unit of change."""
PRIOR_SD = 0.5
"""Prior standard deviation of a step, in the shape's unit of change."""
WIDE = 4.0
"""Ratio of the ends of a positive range from which a shape changes by factors."""
MARGIN, BEYOND = 0.5, 2.0
"""Share of its typical range, and factor, by which a shape may leave that range."""
TONE_STEP_HZ = 0.01
"""Unit of change of a rhythm's frequency: that of a line over 100 s, Hz."""

Columns = Callable[[Candidate], NDArray | None]
"""Compute a candidate's weighted rows, (N, k); None where they are not finite."""


@dataclass(frozen=True)
class Fitted:
    """One candidate and what it explains alone."""

    candidate: Candidate
    columns: NDArray
    """(N, k)."""
    amplitudes: NDArray
    """(k,) those that explain most."""
    gain: float
    """Log likelihood over the baseline's."""


class Alone:
    """Fits single candidates to what the baseline leaves."""

    def __init__(self, columns: Columns, project: Callable[[NDArray], NDArray], measured: NDArray) -> None:
        """Prepare.

        Parameters
        ----------
        columns : callable
            A candidate's rows.
        project : callable
            Takes the baseline off rows (N, k).
        measured : (N,) array
            The torque less the baseline.
        """
        self.columns, self._project, self._measured = columns, project, measured

    def fit(self, candidate: Candidate) -> Fitted | None:
        """Fit a candidate's amplitudes; None where its columns are not finite."""
        columns = self.columns(candidate)
        if columns is None:
            return None
        plain = self._project(columns)
        amplitudes, gain = self._solve(plain, np.zeros(plain.shape[1]))
        return Fitted(candidate, columns, amplitudes, gain)

    def refined(self, start: Fitted) -> tuple[Fitted, NDArray]:
        """Return the candidate at its best shape, and its derivative columns there, (N, d)."""
        if start.candidate.directions:
            # Linear in its shapes: the amplitudes are the shape.
            return _shaped(start), np.zeros((len(self._measured), 0))
        best, units = start, free_shapes(start.candidate)
        slopes = self._slopes(best, units)
        for _ in range(STEPS if units else 0):
            ahead = self._step(best, slopes, units)
            if ahead is None or ahead.gain < best.gain + ENOUGH:
                break
            best = ahead
            slopes = self._slopes(best, units)
        return best, slopes

    def _slopes(self, fitted: Fitted, units: list[tuple[int, float]]) -> NDArray:
        """Return what each free shape does per unit of change, (N, d)."""
        slopes = np.zeros((len(self._measured), len(units)))
        bends = fitted.candidate.bends
        amplitudes = np.ones_like(fitted.amplitudes) if bends else fitted.amplitudes
        for d, (i, unit) in enumerate(units):
            step = DIFFERENCE * unit_at(fitted.candidate, i, unit)
            moved = self.columns(fitted.candidate.moved(i, step))
            if moved is not None and moved.shape == fitted.columns.shape:
                change = (moved - fitted.columns) @ amplitudes
                slopes[:, d] = change / DIFFERENCE
        return slopes

    def _step(self, fitted: Fitted, slopes: NDArray, units: list[tuple[int, float]]) -> Fitted | None:
        """Return the fit after one step along all free shapes."""
        k = fitted.columns.shape[1]
        bends = fitted.candidate.bends
        parts = [slopes] if bends else [fitted.columns, slopes]
        plain = self._project(np.hstack(parts))
        free = plain.shape[1] - len(units)
        precision = np.append(np.zeros(free), np.full(len(units), PRIOR_SD**-2))
        # A bent baseline has no amplitude: what its column leaves is the shape's to explain.
        target = self._measured - self._project(fitted.columns) @ np.ones(k) if bends else None
        solution, _ = self._solve(plain, precision, target)
        candidate = fitted.candidate
        for (i, unit), step in zip(units, solution[free:], strict=True):
            candidate = changed(candidate, i, unit, step)
        return self.fit(candidate)

    def _solve(self, plain: NDArray, precision: NDArray, target: NDArray | None = None) -> tuple[NDArray, float]:
        """Return coefficients (k,) and the log likelihood that they gain."""
        gram = plain.T @ plain + np.diag(precision)
        size = np.sqrt(np.maximum(np.diag(gram), np.finfo(float).tiny))
        scaled = gram / np.outer(size, size) + 1e-9 * np.eye(len(size))
        right = plain.T @ (self._measured if target is None else target) / size
        solution = np.linalg.solve(scaled, right)
        return solution / size, 0.5 * float(right @ solution)


def _shaped(fitted: Fitted) -> Fitted:
    """Return a candidate that is linear in its shapes at the shape which its amplitudes make."""
    candidate = fitted.candidate
    directions = np.array(candidate.directions)
    held = np.array([bool(parameter.forms) for parameter in candidate.effect.shape])
    shape = np.where(held, directions[0], fitted.amplitudes[: len(directions)] @ directions)
    shapes = (tuple(shape.tolist()),) * len(candidate.shapes)
    return replace(fitted, candidate=replace(candidate, shapes=shapes))


def free_shapes(candidate: Candidate) -> list[tuple[int, float]]:
    """Return the shapes that are refined along their slopes, and the unit of change of each.

    The unit is zero where a shape changes by factors. Instants at which something begins are
    found otherwise.
    """
    return [
        (i, _unit_of(parameter))
        for i, parameter in enumerate(candidate.effect.shape)
        if candidate.is_free(i) and i != candidate.onset
    ]


def _unit_of(parameter: Parameter) -> float:
    """Return a shape's unit of change: its grain, its range, or zero where it changes by factors."""
    low, high = parameter.typical
    if parameter.unit in TURNS:
        return parameter.grain
    if parameter.unit == "Hz":
        return TONE_STEP_HZ
    return 0.0 if low > 0.0 and high / low > WIDE else high - low


def unit_at(candidate: Candidate, i: int, unit: float, run: int = 0) -> float:
    """Return the unit of change as a difference, at the candidate's own shape in a run."""
    return unit if unit else abs(candidate.shapes[run][i])


def changed(candidate: Candidate, i: int, unit: float, step: float, runs: Sequence[int] | None = None) -> Candidate:
    """Return the candidate after a step in units of change, within reach of its typical range."""
    parameter, now = candidate.effect.shape[i], candidate.shapes[runs[0] if runs else 0][i]
    low, high = parameter.typical
    step = float(np.clip(step, -LARGEST_STEP, LARGEST_STEP))
    if not unit:
        value = float(np.clip(now * np.exp(step), low / BEYOND, high * BEYOND))
    else:
        beyond = MARGIN * (high - low)
        value = float(np.clip(now + step * unit, low - beyond, high + beyond))
    return candidate.reshaped(i, value, runs)
