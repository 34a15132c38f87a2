"""``exoid detect``: the smallest size of each cause that a motion reveals, and which are tied."""

import json
from collections.abc import Sequence
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any, Literal

import typer

from exoid_cli.console import console
from exoid_cli.experiment_folder import open_experiment, settings_in_force
from exoid_cli.options import ConfigOption, files_argument

if TYPE_CHECKING:
    from pipelines.diagnosis.detectability.detectability import Detectable


def detect(
    files: Annotated[
        list[Path] | None,
        files_argument(
            "One excitation (TOML or trajectory/1), or recordings or motions of one rig.",
            "trajectory.parquet",
        ),
    ] = None,
    output: Annotated[
        Path | None,
        typer.Option("-o", "--output", help="Folder for detectability.json and the figure."),
    ] = None,
    config: ConfigOption = None,
    rig: Annotated[
        Path | None,
        typer.Option(help="A virtual rig's file: the leg that an excitation would move."),
    ] = None,
    runs: Annotated[
        Literal["exo_alone", "with_human", "both"],
        typer.Option(help="Runs that an excitation is planned for."),
    ] = "both",
    power: Annotated[
        float,
        typer.Option(min=0.5, max=0.999, help="Probability of finding an effect of that size."),
    ] = 0.9,
) -> None:
    """Say how large each cause must be to be detected, and which causes cannot be separated.

    \b
    Examples:
      exoid detect
      exoid detect trajectory.toml -o detectable/
      exoid detect recordings/*.parquet --power 0.95
    """
    from pipelines.contracts.atomic import open_folder, write_text
    from pipelines.diagnosis.detectability.detectability import as_json

    if not files:
        # The planned excitation: causes can be judged before the first recording.
        files = [open_experiment(config, problem="no excitation is given").step("design").target]
    experiment = settings_in_force(config)
    if output:
        open_folder(output)
    with console.progress("searching", total=1.0) as report:
        if _is_trajectory(files):
            results = _planned(files, experiment, rig, runs, power, report)
        else:
            results = _recorded(files, experiment, power, report)
    document = {"files": [str(file) for file in files], "power": power, **as_json(results)}
    if output:
        from pipelines.diagnosis.detectability.figure import draw

        text = json.dumps(document, ensure_ascii=False, indent=1)
        write_text(output / "detectability.json", f"{text}\n")
        title = f"What {', '.join(file.name for file in files)} would reveal"
        draw(results, output / "detectability", title)
    console.emit(document)
    _show(results)
    if output:
        console.wrote(output, "detectability.json", "detectability.png")


def _is_trajectory(files: Sequence[Path]) -> bool:
    from pipelines.contracts import TRAJECTORY, contract_of
    from pipelines.errors import InputError

    # Excitations may be TOML; recordings and motions are always Parquet.
    kinds = [file.suffix == ".toml" or contract_of(file) is TRAJECTORY for file in files]
    if any(kinds) and len(files) > 1:
        raise InputError(
            f"{files[kinds.index(True)]}: an excitation among {len(files)} files; give one"
            " excitation, or recordings and motions only"
        )
    return kinds[0]


def _planned(
    files: Sequence[Path], experiment: Any, rig: Path | None, runs: str, power: float, report: Any
) -> list:
    from pipelines.diagnosis.detectability.detectability import detectability
    from pipelines.diagnosis.detectability.planned_runs import (
        planned_motions,
        planned_noise,
        usual_plant,
    )
    from pipelines.diagnosis.evidence.baseline import baseline_of
    from pipelines.diagnosis.evidence.eligibility import refuse_unfit
    from pipelines.diagnosis.evidence.known_effects import known_effects
    from pipelines.diagnosis.evidence.observed_run import observe
    from pipelines.errors import InputError, about
    from pipelines.mechanics.trajectory import read_trajectory
    from pipelines.settings.rig import load_rig

    if not rig:
        experiment.mechanism.refuse_all_but_the_leg("`exoid detect` of an excitation")
    plant = load_rig(rig).plant if rig else usual_plant(experiment.mechanism)
    if plant is None:
        raise InputError(
            f"{rig}: has no [plant], expected the file of a virtual rig; name one that has, or"
            " leave it out"
        )
    design = experiment.design
    kinds = ("exo_alone", "with_human") if runs == "both" else (runs,)
    motions = planned_motions(
        read_trajectory(files[0]), plant, design.noise, kinds, design.sample_rate_hz
    )
    with about(files[0]):
        refuse_unfit(motions)
    observed = [observe(motion) for motion in motions]
    # A planned motion has no residual, so that its noise comes from the settings.
    noise = planned_noise(design.noise, design.sample_rate_hz, observed[0].block)
    known = known_effects(experiment.diagnose.known, motions[0].machine)
    return detectability(observed, baseline_of(observed, known), noise, power, report)


def _recorded(files: Sequence[Path], experiment: Any, power: float, report: Any) -> list:
    from pipelines.diagnosis.detectability.detectability import detectability_of_recorded
    from pipelines.mechanics.read import geometry_from, read_motions, refuse_another_mechanism

    motions = read_motions(files, experiment.filter, geometry_from(experiment))
    refuse_another_mechanism(experiment.mechanism, motions)
    return detectability_of_recorded(motions, power, report, experiment.diagnose.known)


def _show(results: Sequence["Detectable"]) -> None:
    rms = f"rms {results[0].unit}"
    headings = ("cause", "joint", "seen from", rms, "of torque")
    console.table(headings, [_row(one) for one in results], numbers=f"seen from, {rms}, of torque")
    console.say("")
    tied = [(one.effect.label, ", ".join(one.tied_with)) for one in results if one.tied_with]
    console.table(("at that size", "could also be"), tied)
    # As a set of sorted tuples, because each member of a group names all others.
    never = sorted(
        {tuple(sorted((one.effect.label, *one.never_apart))) for one in results if one.never_apart}
    )
    for labels in never:
        console.say(f"This motion cannot separate at any size: {', '.join(labels)}.")


def _row(one: "Detectable") -> tuple[str, ...]:
    from pipelines.wording.label import number

    machine = one.effect.on
    whole = "whole leg" if machine.is_exoskeleton else "whole machine"
    cause = (one.effect.name, one.effect.joint or whole)
    share = one.smallest_rms_nm / one.torque_rms_nm
    # It would need as much torque as the whole motion.
    if share >= 1.0:
        return (*cause, "not detectable", "", "")
    rms = number(machine, one.smallest_rms_nm)
    return (*cause, one.size_in_words(), rms, f"{100 * share:.1f} %")
