"""The history of an investigation: what each step was to decide, and the probabilities after it."""

from dataclasses import dataclass
from pathlib import Path
from typing import Any

from pipelines.contracts.provenance import metadata_of
from pipelines.contracts.verdict import Verdict, read
from pipelines.wording.label import NOTHING
from pipelines.workflow.investigation import motion_of, verdicts_before_steps

SHOWN_FROM = 0.05
"""Probability from which a cause has a place in the history, in any step."""


@dataclass(frozen=True)
class InvestigationStep:
    """One experiment of an investigation, and the verdict on all recordings up to it."""

    step: int
    """0 for the experiment of exoid.toml."""
    runs: int
    """Recordings that the verdict was computed from."""
    decides: float | None
    """The probability that it was expected to decide; None for step 0."""
    probabilities: dict[str, float]
    """Of ``NOTHING`` and of each cause that has ``SHOWN_FROM`` in any step, by its label."""

    def as_json(self) -> dict[str, Any]:
        """Return it for programs."""
        return vars(self)


def history(out: Path, diagnosed: Path) -> list[InvestigationStep]:
    """Return the steps of an investigation.

    Parameters
    ----------
    out : Path
        Folder of the experiment's results.
    diagnosed : Path
        The verdict on all recordings.

    Raises
    ------
    ContractError
        Where a verdict is damaged.
    """
    verdicts = [read(file) for file in (*verdicts_before_steps(out), diagnosed)]
    every = [_probabilities(one) for one in verdicts]
    shown = {label for one in every for label, p in one.items() if p >= SHOWN_FROM}
    return [
        InvestigationStep(
            step,
            len(verdict.provenance.inputs),
            metadata_of(motion_of(out, step)).get("decides") if step else None,
            {label: p for label, p in own.items() if label in shown},
        )
        for step, (verdict, own) in enumerate(zip(verdicts, every, strict=True))
    ]


def _probabilities(verdict: Verdict) -> dict[str, float]:
    posterior = verdict.posterior
    if posterior is None:
        return {}
    return {NOTHING: posterior.nothing_missing, **posterior.causes}
