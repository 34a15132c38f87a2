"""The machines that other people recorded: from their logs to motions and verdicts, by the commands
a user has."""

import json
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np
import pandas as pd
from numpy.typing import NDArray

from exoid_cli.app import run
from pipelines.contracts import PARAMETERS, RESIDUALS
from pipelines.contracts.verdict import EffectAtJoint
from pipelines.dynamics.replay import replay
from pipelines.effects.rotor_inertia import RotorInertia
from pipelines.mechanics.geometry import Geometry
from pipelines.mechanics.motion import Motion
from pipelines.mechanics.read import read_motions
from pipelines.model import Model, Term, baseline, model_from_parameters, term_from
from pipelines.model.per_run import with_own_values
from pipelines.settings.datasets import datasets
from pipelines.settings.filter import FilterSettings
from pipelines.signals.low_pass import ORDER
from tests.campaigns.real.relative_error import TorqueError, slow_error, slow_values


@dataclass(frozen=True)
class Logs:
    """The logs of one machine and the map that exoid brings for them."""

    title: str
    files: str
    """Pattern in the folder of real data."""
    map: str
    known: tuple[str, ...] = ()
    """Effects on its makers' drawings, in addition to rigid body and friction."""

    @property
    def commands(self) -> str:
        """What a user types to get from these logs to a verdict."""
        options = " ".join(("", *self.known_options))
        return (
            f"exoid import $EXOID_REAL_DATA/{self.files} --map datasets/maps/{self.map} -o"
            f" recordings/\nexoid diagnose recordings/*.parquet{options} --out diagnosed/"
        )

    @property
    def known_options(self) -> list[str]:
        """Options of `exoid diagnose` for these effects."""
        return [word for label in self.known for word in ("--known", label)]


LOGS = {
    "emps": Logs("EMPS", "emps/*.mat", "emps.toml"),
    "A0-fourier": Logs(
        "Double pendulum A0, Fourier run",
        "double_pendulum/A0_fourier_75s.csv",
        "double_pendulum_fourier.toml",
    ),
    "A0-swings": Logs(
        "Double pendulum A0, swings", "double_pendulum/A0_swing_*.csv", "double_pendulum.toml"
    ),
    "C1-swings": Logs(
        "Double pendulum C1, swings", "double_pendulum/C1_swing_*.csv", "double_pendulum_C1.toml"
    ),
    "C1-known": Logs(
        "Double pendulum C1, its rotor known",
        "double_pendulum/C1_swing_*.csv",
        "double_pendulum_C1.toml",
        ("rotor_inertia@elbow",),
    ),
    "simple": Logs("Simple pendulum", "simple_pendulum/*.csv", "simple_pendulum.toml"),
    "xl330": Logs("XL330", "xl330/*.json", "xl330.toml"),
    "modexo": Logs("modexo", "modexo/*.csv", "modexo.toml"),
}


def recordings(logs: Logs, data: Path, folder: Path) -> list[Path]:
    """Import the logs into a folder and return the recordings."""
    files = sorted(str(file) for file in data.glob(logs.files))
    _exoid("import", *files, "--map", str(datasets() / "maps" / logs.map), "-o", str(folder))
    return sorted(folder.glob("*.parquet"))


def motions(recorded: list[Path]) -> list[Motion]:
    """Return the recordings filtered as every stage does it by itself."""
    return read_motions(recorded, FilterSettings(), Geometry())


@dataclass(frozen=True)
class Diagnosed:
    """A machine's runs and what ``exoid diagnose`` says of them."""

    motions: list[Motion]
    verdict: dict[str, Any]
    parameters: pd.DataFrame
    folder: Path

    @property
    def causes(self) -> list[tuple[str, str | None]]:
        """Effect and joint of each named cause."""
        return [(cause["effect"], cause["joint"]) for cause in self.verdict["causes"]]

    @property
    def model(self) -> Model:
        """The extended model, with what each run has for itself as in the first."""
        return model_from_parameters(self.parameters, self.motions[0].run, self.motions[0].machine)

    def model_of(self, motion: Motion) -> Model:
        """Return the extended model with what a run has for itself."""
        own = {
            EffectAtJoint.model_validate(cause).label: {
                name: value for name, value in one["values"].items() if value is not None
            }
            for cause in self.verdict["causes"]
            for one in cause["each_run"]
            if one["file"] == motion.file
        }
        return Model(
            tuple(_with_values(term, own.get(term.effect.label, {})) for term in self.model)
        )

    def error_on(self, motion: Motion) -> TorqueError:
        """Return the extended model's error below 5 Hz on a run, reversals included.

        Of a run that no fit has seen and that has a zero of its own, on the halves that the zero
        was not learnt on.
        """
        error = slow_error(self.model_of(motion).torque(motion), motion)
        if motion.purpose == "train" or not any(
            cause["each_run"] for cause in self.verdict["causes"]
        ):
            return error
        residuals = RESIDUALS.read(self.folder / "residuals.parquet").frame
        here = residuals[(residuals["file"] == motion.file) & (residuals["model"] == "extended")]
        rms = np.array(
            [np.sqrt(np.mean(here[f"{joint}_residual_nm"] ** 2)) for joint in motion.joints]
        )
        return TorqueError(rms, error.percent * rms / error.rms)

    def identify(self, name: str, *asked: str) -> dict[str, Model]:
        """Return what ``exoid identify`` finds, asked for something besides, of each run by its
        file.

        ``name`` is that of a folder for it.
        """
        recorded = {
            motion.file: self.folder.parent / "recordings" / motion.file for motion in self.motions
        }
        out = self.folder.parent / name
        _exoid("identify", *map(str, recorded.values()), "-o", str(out), *asked)
        table = PARAMETERS.read(out / "parameters.parquet")
        model = model_from_parameters(table.frame, self.motions[0].run, self.motions[0].machine)
        return {file: with_own_values(model, table, path)[0] for file, path in recorded.items()}

    def identified(self) -> dict[str, Model]:
        """Return what is named as ``exoid identify`` fits it to every sample, those near reversals
        too."""
        return self.identify(
            "refitted", "--causes", str(self.folder / "parameters.parquet"), "--reversals"
        )

    def refitted(self, order: int = ORDER) -> dict[str, Model]:
        """Return the extended model of each run, by its file, by least squares below 5 Hz on the
        runs to train on.

        What a run has for itself stays what the diagnosis found.
        """
        of_runs = {motion.file: self.model_of(motion) for motion in self.motions}
        own = {
            EffectAtJoint.model_validate(cause).label
            for cause in self.verdict["causes"]
            if cause["each_run"]
        }
        free = [effect.label not in own for effect, _ in self.model.linear_parameters]
        trained = of_purpose(self.motions, "train")
        values = slow_values([of_runs[motion.file] for motion in trained], trained, free, order)
        return {
            file: model.with_linear(np.where(free, values, model.linear_values))
            for file, model in of_runs.items()
        }

    def strayed(self, motion: Motion) -> NDArray:
        """Return the rms angle error (J,) of 1 s simulations of the extended model under a run's
        torque."""
        return replay(self.model_of(motion), motion).rmse


def _with_values(term: Term, values: dict[str, float]) -> Term:
    """Return a term with some of its parameters at other values, by the names that files use."""
    names = [p.name for p in term.effect.parameters]
    return term_from(
        term.effect, dict(zip(names, term.effect.physical(term.values), strict=True)) | values
    )


def diagnosed(logs: Logs, data: Path, folder: Path, figures: bool = False) -> Diagnosed:
    """Import and diagnose the logs in a folder."""
    recorded = recordings(logs, data, folder / "recordings")
    out = folder / "diagnosed"
    drawn = "--figures" if figures else "--no-figures"
    _exoid("diagnose", *map(str, recorded), *logs.known_options, "--out", str(out), drawn)
    verdict = json.loads((out / "verdict.json").read_text(encoding="utf-8"))
    return Diagnosed(
        motions(recorded), verdict, PARAMETERS.read(out / "parameters.parquet").frame, out
    )


def _exoid(*arguments: str) -> None:
    code = run(["--quiet", *arguments])
    if code:
        raise RuntimeError(f"exoid {' '.join(arguments)} ended with exit code {code}")


def of_purpose(among: list[Motion], purpose: str) -> list[Motion]:
    """Return the runs to train on, or those to validate on."""
    return [motion for motion in among if motion.purpose == purpose]


def with_rotor(motion: Motion) -> Model:
    """Return the model every lab starts with and the second joint's rotor, without values."""
    machine = motion.machine
    effects = [*baseline(machine, [motion.run]), RotorInertia(machine.names[1], on=machine)]
    return Model.of(effects)


def symmetric(d: Diagnosed) -> dict[str, Model]:
    """Return rigid body, friction and each drive's offset as ``exoid identify`` fits them to every
    sample."""
    offsets = [
        word for name in d.motions[0].joints for word in ("--effect", f"torque_offset@{name}")
    ]
    return d.identify("symmetric", *offsets, "--reversals")
