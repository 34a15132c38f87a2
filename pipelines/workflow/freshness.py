"""Whether a step of an experiment is up to date, and if not, why.

A result holds the hashes of its inputs and its settings, so it is judged by content: copying a
folder, or changing a setting and changing it back, makes nothing stale. Times count only for a
rig's sealed file, whose hash no result may hold.
"""

import os
from collections.abc import Iterator, Mapping, Sequence, Set
from dataclasses import dataclass, field
from enum import Enum
from pathlib import Path
from typing import Any

from pipelines.contracts import parquet
from pipelines.contracts.provenance import provenance_of, sha256
from pipelines.contracts.run_paths import aborted_of, journal_of
from pipelines.errors import ContractError
from pipelines.workflow.graph import Step


class Freshness(Enum):
    """The state of a step."""

    DONE = "done"
    STALE = "stale"
    MISSING = "missing"
    LEFT_OUT = "left out"
    """Its result is missing, but it may fail, and later steps were done without it."""


@dataclass(frozen=True)
class JudgedStep:
    """A step with its state."""

    step: Step
    state: Freshness
    why: tuple[str, ...] = ()
    """One phrase for each reason that it is not done."""

    @property
    def done(self) -> bool:
        """Whether there is nothing to do."""
        return self.state in (Freshness.DONE, Freshness.LEFT_OUT)


@dataclass
class Judge:
    """Judges the steps of one experiment in the order of its graph; a step may be judged again."""

    out: Path
    """Folder of the results; messages name files relative to it."""
    _makers: dict[Path, JudgedStep] = field(default_factory=dict)

    def all(self, steps: Sequence[Step]) -> list[JudgedStep]:
        """Return every step with its state."""
        judged = [self.judge(step) for step in steps]
        # A missing result that is an input of a finished step is not due: that step did without it.
        used = {file for one in judged if one.done for file in one.step.inputs}
        return [_left_out(one) if one.step.target in used else one for one in judged]

    def judge(self, step: Step) -> JudgedStep:
        """Return a step with its state, after the steps that make its inputs were judged."""
        state = Freshness.STALE if step.target.exists() else Freshness.MISSING
        reasons = self._reasons(step) if step.target.exists() else self._remains(step.target)
        why = tuple(dict.fromkeys(reasons))
        judged = JudgedStep(
            step, state if why or state is Freshness.MISSING else Freshness.DONE, why
        )
        self._makers.update(dict.fromkeys(step.makes, judged))
        return judged

    def _reasons(self, step: Step) -> Iterator[str]:
        try:
            metadata = provenance_of(step.target)
        except ContractError as error:
            yield str(error).removeprefix(f"{step.target}: ")
            return
        others = [step.target.with_name(name) for name in metadata.get("beside", [])]
        yield from self._lacking([*step.other_outputs, *others])
        # Names without folders, so that a copied experiment is still up to date.
        inputs = {(entry["name"], entry["sha256"]) for entry in metadata.get("inputs", [])}
        yield from self._other_inputs(step, inputs)
        yield from _other_settings(metadata.get("config", {}), step.settings)
        if step.watched and step.watched.stat().st_mtime_ns > step.target.stat().st_mtime_ns:
            yield f"{self._name(step.watched)} is newer"

    def _lacking(self, outputs: Sequence[Path]) -> Iterator[str]:
        for file in outputs:
            if not file.exists():
                yield f"{self._name(file)} is missing"
            elif file.suffix == ".parquet" and not parquet.is_whole(file):
                yield f"{self._name(file)} is damaged"

    def _other_inputs(self, step: Step, recorded: Set[tuple[str, str]]) -> Iterator[str]:
        names = {name for name, _ in recorded}
        for file in step.inputs:
            maker = self._makers.get(file)
            if maker and maker.step.may_fail and maker.state is Freshness.MISSING:
                continue  # the step can do without
            if maker and not maker.done:
                yield f"waits for {maker.step.stage}"
            elif not file.exists():
                yield f"{self._name(file)} is missing"
            elif file.name not in names:
                yield f"{self._name(file)} was not among its inputs"
            elif (file.name, sha256(file)) not in recorded:
                yield f"{self._name(file)} has changed"
        for name in () if step.takes_all else names - {file.name for file in step.inputs}:
            yield f"{name} is no longer an input"

    def _remains(self, target: Path) -> Iterator[str]:
        """Yield the remains of a run that was killed or stopped early."""
        journal, aborted = journal_of(target), aborted_of(target)
        if journal.exists():
            yield f"a run was killed: `exoid recover` makes a recording of {self._name(journal)}"
        if aborted.exists():
            yield f"a run was stopped early: {self._name(aborted)}"

    def _name(self, file: Path) -> str:
        file = Path(os.path.normpath(file))
        return (file.relative_to(self.out) if file.is_relative_to(self.out) else file).as_posix()


def _left_out(judged: JudgedStep) -> JudgedStep:
    if not judged.step.may_fail or judged.state is not Freshness.MISSING:
        return judged
    return JudgedStep(
        judged.step, Freshness.LEFT_OUT, (f"`exoid run {judged.step.stage}` says why",)
    )


def _other_settings(then: Mapping[str, Any], now: Mapping[str, Any], at: str = "") -> Iterator[str]:
    """Yield the settings that have changed; those that the file does not hold are skipped."""
    # A setting that a newer version adds does not make older results stale.
    for key in sorted(then.keys() & now.keys()):
        old, new = then[key], now[key]
        if isinstance(old, Mapping) and isinstance(new, Mapping):
            yield from _other_settings(old, new, f"{at}{key}.")
        elif old != new:
            yield f"{at}{key} was {_short(old)}, is {_short(new)}"


def _short(value: Any) -> str:
    text = "unset" if value is None else str(value)
    return text if len(text) <= 30 else f"{text[:27]}..."
