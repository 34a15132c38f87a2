"""``exoid.toml``: one experiment, section by section."""

from pathlib import Path
from typing import Any, Self

from pydantic import Field, PrivateAttr, field_validator

from pipelines.errors import SettingsError
from pipelines.settings.acquire import AcquireSettings, RunSettings
from pipelines.settings.base import Settings, load_toml, repeated
from pipelines.settings.design import DesignSettings
from pipelines.settings.diagnose import DiagnoseSettings
from pipelines.settings.filter import FilterSettings
from pipelines.settings.identify import IdentifySettings
from pipelines.settings.investigate import InvestigateSettings
from pipelines.settings.mechanism import MechanismSettings
from pipelines.settings.simulate import SimulateSettings
from pipelines.validation.suggestion import similar_file, suggestion


class Experiment(Settings):
    """All settings of one experiment; every key has a default."""

    mechanism: MechanismSettings = Field(MechanismSettings(), description="Joints and geometry.")
    design: DesignSettings = Field(DesignSettings(), description="The excitation.")
    acquire: AcquireSettings = Field(AcquireSettings(), description="Recording.")
    run: tuple[RunSettings, ...] = Field(
        # Both kinds of run, each once to train and once to validate. Seeds differ, or a virtual
        # rig's validation runs would have the noise of the training runs.
        (
            RunSettings(name="exo_alone_train", run="exo_alone", purpose="train", seed=1),
            RunSettings(name="exo_alone_validate", run="exo_alone", purpose="validate", seed=2),
            RunSettings(name="with_human_train", run="with_human", purpose="train", seed=3),
            RunSettings(name="with_human_validate", run="with_human", purpose="validate", seed=4),
        ),
        description="Runs, in order.",
    )
    filter: FilterSettings = Field(FilterSettings(), description="Filtering.")
    identify: IdentifySettings = Field(IdentifySettings(), description="Identification.")
    diagnose: DiagnoseSettings = Field(DiagnoseSettings(), description="Diagnosis.")
    investigate: InvestigateSettings = Field(
        InvestigateSettings(), description="Further experiments."
    )
    simulate: SimulateSettings = Field(SimulateSettings(), description="Simulation.")

    # No field, as it is no key of the file, and no result is to list it.
    _path: Path = PrivateAttr(default=Path("exoid.toml"))

    @field_validator("run")
    @classmethod
    def _names_differ(cls, runs: tuple[RunSettings, ...]) -> tuple[RunSettings, ...]:
        if not runs:
            raise ValueError("found no run, expected at least one; add a [[run]]")
        for name in repeated(run.name for run in runs):
            raise ValueError(f"found the name {name} twice, expected each once; rename one run")
        return runs

    @classmethod
    def load(cls, path: Path | str) -> Self:
        """Return the experiment in a file; names of files in it are relative to its folder.

        Raises
        ------
        SettingsError
            Names the key that is missing or wrong.
        """
        experiment = load_toml(path, cls)
        experiment._path = Path(path)
        return experiment

    @property
    def path(self) -> Path:
        """The file that it was read from, else exoid.toml."""
        return self._path

    def file(self, name: str) -> Path:
        """Return the path of a file that the settings name."""
        return self._path.parent / name

    def sections(self, *names: str) -> dict[str, Any]:
        """Return some sections as JSON, for the metadata of a result."""
        return {name: getattr(self, name).model_dump(mode="json") for name in names}

    def sections_about(self, a_leg: bool, *names: str) -> dict[str, Any]:
        """Return some sections for the metadata of a result about a leg or another machine.

        The defaults of [mechanism] are those of a leg. For another machine without [mechanism] it
        is null, as its recordings have the mechanism.
        """
        sections = self.sections(*names)
        if "mechanism" in names and not a_leg and not self.mechanism.model_fields_set:
            sections["mechanism"] = None
        return sections

    def refuse_missing_files(self) -> None:
        """Refuse names of missing files.

        Raises
        ------
        SettingsError
            Names the key and the path.
        """
        # A run without a trajectory of its own follows the design's, which is yet to be computed.
        named = {"acquire.rig": self.acquire.rig}
        named |= {
            f"run {run.name}.trajectory": run.trajectory for run in self.run if run.trajectory
        }
        for key, name in named.items():
            path = self.file(name)
            if not path.is_file():
                remedy = similar_file(path) or "its path is relative to this file"
                raise SettingsError(f"{self._path}: {key}: {path}: no such file; {remedy}")

    def refuse_what_cannot_run(self) -> None:
        """Refuse missing files, and a cut-off above the Nyquist frequency.

        Raises
        ------
        SettingsError
            Names the key and its value.
        """
        self.refuse_missing_files()
        cutoff_hz, rate_hz = self.filter.cutoff_hz, self.acquire.sample_rate_hz
        if cutoff_hz != "auto" and cutoff_hz >= rate_hz / 2:
            raise SettingsError(
                f"{self._path}: filter.cutoff_hz: found {cutoff_hz:g}, expected less than half of "
                f"acquire.sample_rate_hz, {rate_hz:g} Hz; lower it"
            )

    def run_named(self, name: str) -> RunSettings:
        """Return one run's settings by its name, or those of NAME+STEP.

        Raises
        ------
        SettingsError
            If there is no run of this name.
        """
        # Runs of an investigation follow from those of exoid.toml, which has no [[run]] for them.
        base, _, step = name.partition("+")
        for run in self.run:
            if run.name == name:
                return run
            # Step 0 is the run itself.
            if run.name == base and step.isdecimal() and int(step) > 0:
                return run.repeated(int(step))
        raise SettingsError(
            f"{self._path}: has no [[run]] named {name};"
            f" {suggestion(name, [run.name for run in self.run])}"
        )
