"""The runs of an identification, checked for completeness."""

from collections.abc import Sequence

from pipelines.errors import InputError
from pipelines.mechanics.remedies import how_to_add
from pipelines.mechanics.run import Run, kinds_of


def train_and_validate(runs: Sequence[Run]) -> tuple[list[Run], list[Run]]:
    """Return the runs to train on, and those to validate on.

    Raises
    ------
    InputError
        If runs are missing.
    """
    train = [run for run in runs if run.purpose == "train"]
    judged = [run for run in runs if run.purpose == "validate"]
    kinds = kinds_of(train)
    listed = ", ".join(f"{run.file} ({run.run}, {run.purpose})" for run in runs) or "none"
    if "exo_alone" not in kinds:
        raise InputError(
            f"found no exo_alone run to train on among: {listed}; friction is fitted with nobody in"
            f" the machine: {how_to_add('train', runs)}"
        )
    if not judged:
        raise InputError(
            f"found no run to validate on among: {listed}; a fit is judged on data it has not seen:"
            f" {how_to_add('validate', runs)}"
        )
    if not any(run.run in kinds for run in judged):
        raise InputError(
            f"found no run to validate on of a kind that is trained on ({', '.join(kinds)})"
            f" among: {listed}; record one, or give a {judged[0].run} run to train on"
        )
    return train, judged
