"""``exoid diagnose``: what the model gets wrong, its physical cause, and what naming it gains."""

import json
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any

import typer

from exoid_cli.console import console
from exoid_cli.place import ConfigOption, place_of, settings_in_force
from exoid_cli.steps import AgainOption, only

if TYPE_CHECKING:
    from pipelines.mechanics.machine import Machine


def diagnose(
    context: typer.Context,
    files: Annotated[
        list[Path] | None,
        typer.Argument(
            metavar="FILE",
            help="recording/1 or motion/1 files, some to train, some to validate.",
            show_default="recordings/RUN.parquet of every run",
        ),
    ] = None,
    output: Annotated[
        Path | None,
        typer.Option(
            "-o", "--output", "--out", help="Folder for verdict, tables and figures.", show_default="diagnosed/"
        ),
    ] = None,
    config: ConfigOption = None,
    again: AgainOption = False,
    figures: Annotated[bool, typer.Option("--figures/--no-figures", help="Whether to draw the figures.")] = True,
) -> None:
    """Name what rigid body and friction get wrong, extend the model with it, and measure the gain.

    \b
    Examples:
      exoid diagnose
      exoid diagnose recordings/*.parquet -o diagnosed/
    """
    from pipelines.contracts import CANDIDATES, PARAMETERS, RESIDUALS, describe
    from pipelines.contracts.atomic import open_folder, write_text
    from pipelines.diagnosis.candidate_table import candidates
    from pipelines.diagnosis.detect import as_json, detectability
    from pipelines.diagnosis.diagnose import diagnose as find
    from pipelines.diagnosis.figures import FIGURES, draw
    from pipelines.diagnosis.verdict import verdict
    from pipelines.mechanics.read import geometry_from, read_motions, refuse_another_mechanism

    if not files and output is None and figures:
        only(context, place_of(config, lacking="no recording is given"), "diagnose", again=again)
        return
    if not files:
        files = list(place_of(config, lacking="no recording is given").step("diagnose").inputs)
    if output is None:
        output = place_of(config, lacking="-o: missing").step("diagnose").target.parent
    settings = settings_in_force(config)
    tables = {"parameters": PARAMETERS, "residuals": RESIDUALS, "candidates": CANDIDATES}
    for name, contract in tables.items():
        contract.refuse_place(output / f"{name}.parquet")
    motions = read_motions(files, settings.filter, geometry_from(settings.mechanism))
    refuse_another_mechanism(settings.mechanism, motions)
    open_folder(output)
    with console.progress("diagnosing", 1.0) as report:
        found = find(motions, report)
    said = verdict(found)
    shared = {"joints": motions[0].joint_metadata} | describe(files, settings.sections("mechanism", "filter"))
    model = {
        "covariance": found.covariance.tolist(),
        "mechanism": motions[0].machine.mechanism.name,
        "geometry": motions[0].geometry.metadata(),
        "method": {"name": "joint fit of baseline and named causes", "status": found.status},
    }
    frames = {"parameters": found.parameters, "residuals": found.residuals, "candidates": candidates(found)}
    visible = as_json(detectability(found.train, found.baseline, found.floor))
    # The verdict goes first and comes last: it never stands beside tables of another diagnosis.
    (output / "verdict.json").unlink(missing_ok=True)
    for name, contract in tables.items():
        contract.write(output / f"{name}.parquet", frames[name], shared | (model if name == "parameters" else {}))
    write_text(
        output / "detectability.json", json.dumps(visible | {"provenance": shared}, indent=1, ensure_ascii=False) + "\n"
    )
    for old in (output / f"{name}.{kind}" for name in FIGURES for kind in ("png", "pdf")):
        old.unlink(missing_ok=True)
    if figures:
        draw(found, said, output)
    write_text(output / "verdict.json", json.dumps(said | {"provenance": shared}, indent=1, ensure_ascii=False) + "\n")
    console.emit(said)
    _show(said, motions[0].machine, output)
    if figures:
        console.say(f"figures: {', '.join(f'{name}.png' for name in FIGURES)}")


def _show(said: dict[str, Any], machine: "Machine", output: Path) -> None:
    console.say(said["summary"])
    for caveat in said["caveats"]:
        console.say(f"But {caveat}.")
    console.say("")
    first, digits = machine.joints[0], ".3f" if machine.is_exoskeleton else ".4g"
    told = ("noise_floor_nm", "baseline_rmse_nm", "extended_rmse_nm")
    console.table(
        ("joint", "noise floor", "rigid + friction", "with the causes", "excess left"),
        [
            (joint, *(f"{said[key][joint]:{digits}}" for key in told),
             "at the floor" if said["unexplained"][joint] is None else f"{said['unexplained'][joint]:.0%}")
            for joint in machine.names
        ],
        title=f"{first.effort} error on runs no fit has seen, {first.unit('torque')}",
        numbers="noise floor, rigid + friction, with the causes, excess left",
    )  # fmt: skip
    if said["causes"]:
        console.say(_control(said["control"]))
    for cause in said["causes"]:
        where = f" at the {cause['joint']}" if cause["joint"] else ""
        console.say(f"\n{cause['effect']}{where} ({cause['side']}), probability {cause['probability']:.2f}")
        for p in cause["parameters"]:
            console.say(f"  {_in_words(p)}")
        for sentence in cause["evidence"]:
            console.say(f"  - {sentence}")
        for tie in cause["indistinguishable_from"]:
            other = f"{tie['effect']}@{tie['joint']}" if tie["joint"] else tie["effect"]
            console.say(f"  or {other}: {tie['why']}; {tie['how_to_separate']}")
    console.say(f"\n{output}: verdict.json, parameters, residuals, candidates, detectability.json")


def _in_words(parameter: dict[str, Any]) -> str:
    """Return a parameter with its interval; what was assumed, or chosen among a few values, has none."""
    low, high = parameter["ci95"]
    unit = "" if parameter["unit"] == "1" else f" {parameter['unit']}"
    sure = "taken, not fitted" if low == high else f"{low:.4g} … {high:.4g}"
    return f"{parameter['name']} {parameter['value']:.4g}{unit} ({sure})"


def _control(said: dict[str, Any]) -> str:
    """Return one line: tracking error and peak torque under adaptive control, without and with the causes."""
    if said["reason"]:
        return f"under adaptive control: not compared, {said['reason']}"
    before, after = said["without"], said["with"]
    of_joints = [
        f"{joint} error {1e3 * before['tracking_rmse_rad'][joint]:.2f} -> {1e3 * error:.2f} mrad, "
        f"peak torque {before['peak_torque_nm'][joint]:.1f} -> {after['peak_torque_nm'][joint]:.1f} N·m"
        for joint, error in after["tracking_rmse_rad"].items()
    ]
    return (
        "under adaptive control, without -> with the causes: " + "; ".join(of_joints)
        + " (what each model promises; the one with the causes may well promise worse)"
    )  # fmt: skip
