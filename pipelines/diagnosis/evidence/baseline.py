"""Define the model without causes, with which every cause is compared.

It has rigid bodies of machine and person, Coulomb and viscous friction, effects that the machine is
known to have, and the zeros of the cuffs' force sensors.
"""

from collections.abc import Sequence
from dataclasses import dataclass, replace
from functools import cached_property

from numpy.typing import NDArray

from pipelines.contracts.joint_units import FIRST_MOMENT
from pipelines.diagnosis.evidence.observed_run import Run
from pipelines.effects import Effect
from pipelines.mechanics.machine import Machine
from pipelines.mechanics.run import kinds_of
from pipelines.model import Model, ParameterLayout, Term, baseline


@dataclass(frozen=True)
class Baseline:
    """The model without causes, for the kinds of run at hand."""

    kinds: tuple[str, ...]
    machine: Machine
    cuffs: bool
    known: tuple[Effect, ...] = ()
    """Other effects that the machine is known to have; each acts like friction, by linear
    parameters that all runs share."""

    @property
    def joints(self) -> tuple[str, ...]:
        """Names of the machine's joints."""
        return self.machine.names

    @cached_property
    def effects(self) -> tuple[Effect, ...]:
        """Rigid bodies, friction, known effects, and the force sensors' zeros."""
        return baseline(self.machine, self.kinds, self.known, cuffs=self.cuffs)

    @cached_property
    def terms(self) -> tuple[Term, ...]:
        """The effects as terms of a model, with zero linear parameters."""
        return Model.of(self.effects).terms

    @cached_property
    def layout(self) -> ParameterLayout:
        """Its columns, which all runs share: the first of every fit."""
        return ParameterLayout.of(self.effects)

    @cached_property
    def nonnegative(self) -> list[int]:
        """Columns whose values are never negative: inertia, friction, and known effects.

        First moments of mass may be negative: a link may be overbalanced.
        """
        columns = enumerate(self.layout.columns)
        return [
            k
            for k, c in columns
            if c.parameter.typical[0] >= 0.0 and c.parameter.unit != FIRST_MOMENT
        ]

    @property
    def size(self) -> int:
        """Number of columns."""
        return self.layout.size


def baseline_of(runs: Sequence[Run], known: Sequence[Effect] = ()) -> Baseline:
    """Return the baseline that the kinds of run allow, with the effects in ``known``."""
    kinds = kinds_of(run.motion for run in runs)
    return Baseline(kinds, runs[0].motion.machine, any(run.has_cuffs for run in runs), tuple(known))


def only_trained_outputs(run: Run, baseline: Baseline) -> Run:
    """Return the run without its cuffs if no training run has any: their zeros are unknown."""
    if baseline.cuffs or not run.has_cuffs:
        return run
    usable = run.usable.copy()
    usable[:, len(baseline.joints) :] = False
    return replace(run, usable=usable)


def relaxed(refitted: NDArray, before: NDArray | None) -> NDArray:
    """Return baseline values part of the way to refitted ones.

    Parameters
    ----------
    refitted : (b,) array
        Values of the last fit.
    before : (b,) array or None
        Values before it; None: the refitted ones are returned.

    Returns
    -------
    (b,) array
        In the parameters' units.
    """
    # Half a step: with a soft spring a full one overshoots, and alternates between heavier and
    # lighter bodies for ever.
    return refitted if before is None else 0.5 * refitted + 0.5 * before


def with_load(run: Run, baseline: Baseline, values: NDArray) -> Run:
    """Return the run with loads of links and limb from the baseline's rigid bodies.

    Parameters
    ----------
    run : Run
    baseline : Baseline
    values : (b,) array
        Values of the baseline.
    """
    layout = baseline.layout
    # The wearer's body adds to the machine's: the drives move both.
    body = values[layout.bodies_in(run.motion.run)].sum(axis=0)
    return replace(run, motion=run.motion.loaded(body, values[layout.bodies[-1]]))
