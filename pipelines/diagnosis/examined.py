"""What a set of causes leaves of the validation runs, and whether that lets them stay named."""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from functools import cached_property

import numpy as np
from numpy.typing import NDArray

from pipelines.diagnosis.bank import Bank
from pipelines.diagnosis.choice import NEEDED, Choice, without
from pipelines.diagnosis.evaluate import evaluate
from pipelines.diagnosis.fit import Fit
from pipelines.diagnosis.floor import Floor, noise_floor, slow_scatter
from pipelines.diagnosis.gain import Errors, Gain, errors_of, gain
from pipelines.diagnosis.imperfection import telling_torque
from pipelines.diagnosis.observations import Baseline, Run
from pipelines.diagnosis.perceived import felt_in, heard_in
from pipelines.diagnosis.slow import SlowError, slow_error
from pipelines.diagnosis.status import WANDERING, Standing
from pipelines.diagnosis.tone import strongest_tone


@dataclass(frozen=True)
class Extended:
    """A set of causes, fitted, and what it leaves of the validation runs."""

    fit: Fit
    runs: Sequence[Run]
    """The validation runs."""
    residuals: tuple[NDArray, ...]
    """(m, O) of each of them."""
    errors: Errors

    @classmethod
    def of(cls, made: Fit, validate: Sequence[Run], baseline: Baseline) -> "Extended":
        """Evaluate a fit on the validation runs."""
        residuals = tuple(evaluate(made, validate, baseline))
        return cls(made, validate, residuals, errors_of(validate, residuals))

    @cached_property
    def slow(self) -> SlowError:
        """What is left in averages over 0.1 s."""
        return slow_error(self.runs, self.residuals)

    @property
    def whole(self) -> list[NDArray]:
        """What is left, (m, O) of each run, with what of the torque is faster than what was looked at."""
        return [run.with_fast(left) for run, left in zip(self.runs, self.residuals, strict=True)]

    @cached_property
    def tone(self) -> NDArray:
        """(J,) N·m rms of the strongest line at each joint."""
        return strongest_tone(self.runs, self.whole)[: len(self.runs[0].motion.joints)]

    @cached_property
    def perceived(self) -> dict[str, float]:
        """Log likelihood that is known of causes besides what they do to the mean torque, by label."""
        return heard_in(self.runs, self.residuals) | felt_in(self.runs, self.residuals)


def gains_beside(without: Mapping[str, Extended], after: Extended) -> dict[str, Gain]:
    """Return what each cause of a set gains on the validation runs beside the others, by its label."""
    return {label: gain(less.errors, after.errors) for label, less in without.items()}


@dataclass(frozen=True)
class Examined:
    """What a fit leaves of the validation runs, and what that says of its causes."""

    after: Extended
    floor: Floor
    standing: Standing
    unsteady: bool
    """Whether something hums, or does not repeat with the motion."""
    holds_up: bool
    """Whether its causes may stay named."""
    sure: tuple[str, ...]
    """Labels of those that were heard or felt in the validation runs themselves, whatever the others explain."""
    without: dict[str, Extended]
    """The set less one cause, by that cause's label."""

    @property
    def helpful(self) -> tuple[str, ...]:
        """Labels of the causes without which the validation runs are not plainly explained better, unless heard."""
        gains = gains_beside(self.without, self.after)
        return tuple(label for label, its in gains.items() if label in self.sure or its.high >= 0.0)

    @classmethod
    def of(cls, choice: Choice, before: Extended, validate: Sequence[Run], bank: Bank) -> "Examined":
        """Examine what is chosen beside the baseline."""
        made, baseline, labels = choice.named.fit, bank.baseline, choice.named.labels
        J = len(baseline.joints)
        after = Extended.of(made, validate, baseline)
        floor = noise_floor(validate, after.residuals)
        standing = _standing(before, after, floor)
        hums = standing.hums(before.tone, after.tone, noise_floor(validate, after.whole).rms[:J])
        wanders = bool(np.any(slow_scatter(validate, after.whole)[:J] > WANDERING))
        effects = [cause.effect for cause in made.causes]
        doubtful = hums and not (standing.is_minor(after.tone) or standing.leaves_nothing)
        foreign = (doubtful or (wanders and not any(e.goes_with_time for e in effects))) and not standing.rings(effects)
        # Play rings on as it likes, and a wearer pushes at will: what no model follows there is no reason to doubt
        # what was heard and felt in these runs too.
        less = {
            label: before if labels == (label,) else Extended.of(without(made, label, bank), validate, baseline)
            for label in labels
        }
        sure = tuple(
            label for label in labels if all(e.perceived.get(label, 0.0) > NEEDED for e in (before, less[label]))
        )
        all_sure = bool(sure) and len(sure) == len(labels) and not standing.drowns
        holds_up = all_sure or ((bool(sure) or not foreign) and standing.held_up(effects))
        if not holds_up and not foreign and choice.freer is not None:
            # What is left may be the cause's own, in a form that is freer than ours.
            freer = Extended.of(choice.freer, validate, baseline)
            holds_up = standing.takes_enough and _standing(before, freer, floor).held_up(effects)
        return cls(after, floor, standing, wanders or hums, holds_up, sure, less)


def _standing(before: Extended, after: Extended, floor: Floor) -> Standing:
    J, torque = len(before.runs[0].motion.joints), telling_torque(before.runs)
    return Standing(floor.rms[:J], before.errors.rms, after.errors.rms, before.slow, after.slow, torque)
