"""The graph of an experiment: which file comes from which, by which command and settings.

This is its only definition: ``exoid run``, ``exoid status``, commands without arguments, and make,
by the rules that ``split`` writes, all use it.
"""

from collections.abc import Iterable, Iterator, Mapping, Sequence
from dataclasses import dataclass, replace
from itertools import chain
from pathlib import Path
from typing import Any

from pipelines.settings.acquire import RunSettings
from pipelines.settings.experiment import Experiment
from pipelines.settings.rig import load_rig
from pipelines.settings.rig.recording_only import is_recording_only
from pipelines.workflow.imported import ImportedRuns
from pipelines.workflow.investigation import motion_of

STAGES = (
    "design",
    "acquire",
    "filter",
    "identify",
    "diagnose",
    "simulate",
    "replay",
    "extended",
    "report",
)
"""All stages; an experiment may have no step of some."""


@dataclass(frozen=True)
class Step:
    """One call of one command."""

    stage: str
    """The stage it belongs to; a stage has one step, or one for each run."""
    target: Path
    """The file that holds the hashes of its inputs and its settings."""
    inputs: tuple[Path, ...]
    """Files whose content counts: targets of other steps, or the user's own."""
    settings: Mapping[str, Any]
    """Settings that count, by the section they are recorded under in the target."""
    command: tuple[str, ...]
    """Arguments for exoid; the output is the last one."""
    run: str | None = None
    """The run it is for; None if it is for all."""
    watched: Path | None = None
    """A further input, whose hash no result may hold; its time counts."""
    other_outputs: tuple[Path, ...] = ()
    """Further files that the command always makes; if one is missing, the step is stale."""
    may_fail: bool = False
    """Whether later steps can do without it: not every model with causes can be simulated."""
    takes_all: bool = False
    """Whether it also reads any other file in the folder of the results."""

    @property
    def makes(self) -> tuple[Path, ...]:
        """Every file that it makes."""
        return (self.target, *self.other_outputs)


def graph(
    experiment: Experiment, config: Path, out: Path, imported: ImportedRuns = ImportedRuns()
) -> tuple[Step, ...]:
    """Return an experiment's steps, each after those it needs.

    Parameters
    ----------
    experiment : Experiment
    config : Path
        Its file, as the commands name it.
    out : Path
        Folder of the results.
    imported : ImportedRuns, optional
        Runs whose recordings were imported: no step makes these, see ``with_imported``.
    """
    return tuple(_Steps(experiment, config, out, imported).all())


@dataclass(frozen=True)
class _Steps:
    """The steps of one experiment."""

    experiment: Experiment
    config: Path
    out: Path
    imported: ImportedRuns

    @property
    def _config_option(self) -> tuple[str, str]:
        return "--config", self.config.as_posix()

    @property
    def _recordings(self) -> dict[str, Path]:
        folder = self.out / "recordings"
        return {run.name: folder / f"{run.name}.parquet" for run in self.experiment.run}

    @property
    def _motions(self) -> dict[str, Path]:
        folder = self.out / "motions"
        return {name: folder / path.name for name, path in self._recordings.items()}

    @property
    def _validate(self) -> list[str]:
        """Names of the runs to validate on."""
        return [run.name for run in self.experiment.run if run.purpose == "validate"]

    def all(self) -> Iterator[Step]:
        """Yield each step after those it needs."""
        steps = [*self._recorded(), *self._filtered(), self._identified()]
        simulated = self.out / "simulated"
        # An imported recording may lack what a model needs to be simulated.
        may_fail = bool(self.imported.names)
        loops = self._simulated(steps[-1].target, simulated, "simulate", "replay", may_fail)
        if self._validate:
            # A diagnosis measures its gain on validation runs; without one there is none.
            steps.append(self._diagnosed())
            extended = steps[-1].target.with_name("parameters.parquet")
            folder = simulated / "extended"
            again = self._simulated(extended, folder, "extended", "extended", may_fail=True)
            loops = chain(loops, again)
        steps += loops
        yield from steps
        shown = [file for one in steps if one.stage != "filter" for file in one.makes]
        report = self._step(
            "report", self.out / "report.html", shown, (), "report", self.out.as_posix()
        )
        yield replace(report, takes_all=True)

    def _step(
        self,
        stage: str,
        target: Path,
        inputs: Iterable[Path],
        settings: Sequence[str],
        *command: str,
        run: str | None = None,
        other_outputs: Iterable[str] = (),
    ) -> Step:
        sections = self.experiment.sections_about(self.imported.of_a_leg, *settings)
        # A section that exoid.toml lacks is not compared with the result's.
        counted = {name: section for name, section in sections.items() if section is not None}
        others = tuple(target.with_name(name) for name in other_outputs)
        words = (*command, *self._config_option, "-o", _output(stage, target))
        return Step(stage, target, tuple(inputs), counted, words, run, other_outputs=others)

    def _recorded(self) -> Iterator[Step]:
        """Yield the design, if a run needs one, and the runs that were not imported."""
        trajectory, recordings = self.out / "trajectory.parquet", self._recordings
        recorded = [
            _recorded(
                self.experiment,
                run,
                recordings[run.name],
                motion_of(self.out, run.step) if run.step else trajectory,
                self._config_option,
            )
            for run in self.experiment.run
            if run.name not in self.imported.names
        ]
        # Nothing is designed if each run has an excitation of its own, or was imported.
        if any(trajectory in one.inputs for one in recorded):
            yield self._step("design", trajectory, (), ("design", "mechanism"), "design")
        yield from recorded

    def _filtered(self) -> Iterator[Step]:
        motions = self._motions
        for name, recording in self._recordings.items():
            command = ("filter", recording.as_posix())
            yield self._step("filter", motions[name], [recording], ["filter"], *command, run=name)

    def _identified(self) -> Step:
        return self._step(
            "identify",
            self.out / "identified" / "parameters.parquet",
            self._motions.values(),
            ("identify", "mechanism"),
            "identify",
            *_words(self._motions),
            # Files that these commands always write next to their target; figures are not checked.
            other_outputs=("residuals.parquet",),
        )

    def _diagnosed(self) -> Step:
        return self._step(
            "diagnose",
            self.out / "diagnosed" / "verdict.json",
            self._recordings.values(),
            # It filters the recordings itself, so that [filter] counts as well.
            ("filter", "mechanism", "diagnose"),
            "diagnose",
            *_words(self._recordings),
            other_outputs=(
                "parameters.parquet",
                "residuals.parquet",
                "candidates.parquet",
                "detectability.json",
            ),
        )

    def _simulated(
        self, model: Path, folder: Path, loop: str, replay: str, may_fail: bool
    ) -> Iterator[Step]:
        """Yield the adaptive loop and the replays of a model, in stages of these names."""
        command, recordings = ("simulate", model.as_posix()), self._recordings
        if self.imported.of_a_leg:
            sweep = [SWEEP] if self.experiment.simulate.sweep_nm_s_rad else []
            counted = ("simulate", "mechanism")
            step = self._step(loop, folder / LOOP, [model], counted, *command, other_outputs=sweep)
            yield replace(step, may_fail=may_fail)
        for name in self._validate:
            target, inputs = folder / f"replay-{name}.parquet", [model, recordings[name]]
            words = (*command, "--replay", recordings[name].as_posix())
            # A replay filters its recording, too, but reads no setting of the adaptive loop.
            step = self._step(replay, target, inputs, ("filter", "mechanism"), *words, run=name)
            yield replace(step, may_fail=may_fail)


LOOP, SWEEP = "rbf.parquet", "kv-sweep.csv"


def _output(stage: str, target: Path) -> str:
    """Return the output argument of a command: a folder for some."""
    whole_folder = ("identify", "diagnose")
    is_folder = stage in whole_folder or target.name == LOOP
    return f"{target.parent.as_posix()}/" if is_folder else target.as_posix()


def _words(files: Mapping[str, Path]) -> list[str]:
    return [file.as_posix() for file in files.values()]


def _recorded(
    experiment: Experiment,
    run: RunSettings,
    target: Path,
    designed: Path,
    config_option: tuple[str, ...],
) -> Step:
    """Return the step that records one run; its rig and its excitation count by their content."""
    excitation = experiment.file(run.trajectory) if run.trajectory else designed
    rig = experiment.file(experiment.acquire.rig)
    # The rig counts by its content, as an input does: its path differs between computers.
    counted = {
        "acquire": {"sample_rate_hz": experiment.acquire.sample_rate_hz},
        "run": run.model_dump(mode="json"),
    }
    words = ("acquire", *config_option, "--run", run.name)
    inputs: tuple[Path, ...] = (rig,)
    # A machine that its own controller moves follows no excitation of exoid's.
    if not is_recording_only(rig):
        words = (*words, "--trajectory", excitation.as_posix())
        inputs = (excitation, rig)
    command, sealed = (*words, "-o", target.as_posix()), sealed_file(rig)
    return Step("acquire", target, inputs, counted, command, run=run.name, watched=sealed)


def sealed_file(rig: Path) -> Path | None:
    """Return the sealed file of a virtual rig, if it exists."""
    plant = load_rig(rig).plant if rig.is_file() and not is_recording_only(rig) else None
    sealed = rig.parent / plant.sealed if plant and plant.sealed else None
    return sealed if sealed and sealed.is_file() else None


def needed_for(wanted: Sequence[Step], steps: Sequence[Step]) -> list[Step]:
    """Return the wanted steps and all that make their inputs, in the order of the graph."""
    files = {file for step in wanted for file in (step.target, *step.inputs)}
    # Backwards, so that one pass also collects what makes the inputs of inputs.
    for step in reversed(steps):
        if not files.isdisjoint(step.makes):
            files.update(step.inputs)
    return [step for step in steps if not files.isdisjoint(step.makes)]
