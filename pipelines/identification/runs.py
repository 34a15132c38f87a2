"""The runs of an identification, checked for completeness."""

from collections.abc import Sequence
from dataclasses import dataclass

from pipelines.errors import InputError
from pipelines.mechanics.one_machine import refuse_several_machines
from pipelines.mechanics.origin import giving
from pipelines.mechanics.run import Run, kinds_of


@dataclass(frozen=True)
class Runs:
    """Runs of one machine."""

    motions: tuple[Run, ...]

    def of(self, purpose: str, run: str | None = None) -> list[Run]:
        """Return the runs of a purpose.

        Parameters
        ----------
        purpose : str
            ``train`` or ``validate``.
        run : str, optional
            Kind of run; all kinds by default.
        """
        return [m for m in self.motions if m.purpose == purpose and run in (None, m.run)]

    @property
    def kinds(self) -> tuple[str, ...]:
        """The kinds of training run, exo_alone first."""
        return kinds_of(self.of("train"))


def checked(motions: Sequence[Run]) -> Runs:
    """Return the runs of an identification.

    Raises
    ------
    InputError
        If they are of several machines, or training or validation runs are missing.
    """
    runs = Runs(tuple(motions))
    listed = ", ".join(f"{m.file} ({m.run}, {m.purpose})" for m in motions) or "none"
    if not runs.of("train", "exo_alone"):
        raise InputError(
            f"found no exo_alone run to train on among: {listed}; friction is fitted with nobody in"
            f" the machine: {giving('train', motions)}"
        )
    if not runs.of("validate"):
        raise InputError(
            f"found no run to validate on among: {listed}; a fit is judged on data it has not seen:"
            f" {giving('validate', motions)}"
        )
    if not any(run.run in runs.kinds for run in runs.of("validate")):
        raise InputError(
            f"found no run to validate on of a kind that is trained on ({', '.join(runs.kinds)})"
            f" among: {listed}; record one, or give a {runs.of('validate')[0].run} run to train on"
        )
    refuse_several_machines(motions)
    return runs
