"""What is to be estimated from what: some columns of a model, from the training runs of some kinds."""

from collections.abc import Iterator, Mapping
from dataclasses import dataclass, field, replace
from functools import cached_property

import numpy as np
from numpy.typing import NDArray

from pipelines.estimation.compressed import Compressed, compress, together
from pipelines.estimation.regression import Regression, regressions, residual_of
from pipelines.mechanics.run import Run
from pipelines.mechanics.silence import silent_torque
from pipelines.model import Model, Term


@dataclass(frozen=True)
class Training:
    """The runs that a model is fitted to."""

    runs: tuple[Run, ...]
    model: Model
    """Of all kinds of run; what a run has not is a column of zeros there."""
    own: Mapping[str, tuple[Term, ...]] = field(default_factory=dict)
    """By a run's file, terms that it has for itself; they are held as they are."""
    reversals: bool = False
    """Whether samples near reversals are fitted, too."""

    def model_of(self, run: Run, values: NDArray) -> Model:
        """Return the model of one run with some linear values, (p,), and what the run has for itself."""
        return Model((*self.model.with_linear(values), *self.own.get(run.file, ())))

    def regressions(self, run: Run) -> Iterator[Regression]:
        """Yield a run's regression on the p columns, less the torque of what it has for itself, piece by piece."""
        p = len(self.model.linear_parameters)
        whole = self.model_of(run, np.zeros(p))
        own = whole.linear_values
        for r in regressions(run, whole):
            yield replace(
                r, regressor=r.regressor[:, :, :p], torque=residual_of(r, own),
                usable=np.broadcast_to(r.valid[:, np.newaxis], r.usable.shape) if self.reversals else r.usable,
            )  # fmt: skip

    @cached_property
    def compressed(self) -> tuple[Compressed, ...]:
        """Each run's rows on all columns; they are gone through once, whatever is fitted to them.

        Raises
        ------
        InputError
            Where the torque of a joint is nought in all of them.
        """
        parts = tuple(compress(self.regressions(run)) for run in self.runs)
        # Of triangles only nought is told from a constant; the diagnosis sees the samples.
        for j, joint in enumerate(self.runs[0].machine.joints if self.runs else ()):
            if all(part.count[j] > 0 and not part.torque[j].any() for part in parts):
                raise silent_torque(self.runs, joint, 0.0)
        return parts

    @cached_property
    def whole(self) -> "Training":
        """The same with whole runs in memory."""
        return replace(self, runs=tuple(run.whole() for run in self.runs))


@dataclass(frozen=True)
class Problem:
    """``torque = regressor @ parameters + noise``, p parameters, some of which are fitted and the others held."""

    training: Training
    kinds: tuple[str, ...]
    """Of the runs that are fitted."""
    fitted: NDArray
    """(k,) columns that are fitted."""
    held: NDArray
    """(p,) values of the columns that are held; those of the fitted ones say nothing."""

    @property
    def model(self) -> Model:
        """The training's."""
        return self.training.model

    @property
    def names(self) -> list[str]:
        """What messages call the fitted parameters."""
        chosen = [self.model.linear_parameters[column] for column in self.fitted]
        return [f"{effect.joint} {p.name}" if effect.joint else p.name for effect, p in chosen]

    @property
    def runs(self) -> list[tuple[int, Run]]:
        """Number and run of those that are fitted."""
        return [(number, run) for number, run in enumerate(self.training.runs) if run.run in self.kinds]

    @property
    def rows(self) -> Compressed:
        """All usable rows of these runs on all columns, compressed."""
        return together([self.training.compressed[number] for number, _ in self.runs])

    @property
    def of_held(self) -> NDArray:
        """Columns that are held, (p - k,)."""
        return np.setdiff1d(np.arange(len(self.held)), self.fitted)

    def regressions(self) -> Iterator[tuple[int, Regression]]:
        """Yield each run's number and its regression on all columns, piece by piece."""
        for number, run in self.runs:
            for regression in self.training.regressions(run):
                yield number, regression

    def whole(self) -> "Problem":
        """Return the same problem with whole runs in memory, for methods that simulate them."""
        return replace(self, training=self.training.whole)

    def completed(self, values: NDArray) -> NDArray:
        """Return the values of all columns, (p,), for those of the fitted ones."""
        every = self.held.copy()
        every[self.fitted] = values
        return every
