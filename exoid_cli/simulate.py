"""``exoid simulate``: the identified leg under the adaptive controller, or a recording's replay."""

from math import isfinite
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any, Literal

import typer

from exoid_cli.console import console
from exoid_cli.experiment_folder import open_experiment, settings_in_force
from exoid_cli.options import AgainOption, ConfigOption, files_argument, output_option
from exoid_cli.stage_runner import run_stages

if TYPE_CHECKING:
    from pandas import DataFrame

    from pipelines.contracts import Joint, Table
    from pipelines.dynamics.plant import Plant
    from pipelines.dynamics.tracking import ClosedLoop
    from pipelines.settings import Experiment


def simulate(
    context: typer.Context,
    parameters: Annotated[
        Path | None, files_argument("A parameters/1 file.", "identified/parameters.parquet")
    ] = None,
    output: Annotated[
        Path | None,
        output_option(
            "Folder for the loop's table and figures; with --replay, a file.", "simulated/"
        ),
    ] = None,
    config: ConfigOption = None,
    again: AgainOption = False,
    run: Annotated[
        Literal["exo_alone", "with_human"] | None,
        typer.Option(
            help="Whose parameters.", show_default="with_human, if the model has it; a replay's own"
        ),
    ] = None,
    reference: Annotated[
        Path | None, typer.Option(help="What to follow: trajectory/1 or TOML; a gait unless given.")
    ] = None,
    replay: Annotated[
        Path | None,
        typer.Option(help="A recording/1 or motion/1 to simulate again, with its own run."),
    ] = None,
) -> None:
    """Simulate the leg under adaptive RBF control, or replay a recording on the model.

    Without a file, in an experiment's folder, it does both, and replays every
    validation run.

    \b
    Examples:
      exoid simulate
      exoid simulate --replay recordings/with_human_validate.parquet
      exoid simulate identified/parameters.parquet -o simulated/
      exoid simulate identified/parameters.parquet -o simulated/replay.parquet \\
        --replay recordings/with_human_validate.parquet
    """
    from pipelines.contracts import PARAMETERS
    from pipelines.errors import SettingsError

    if replay and reference:
        raise SettingsError(
            "--reference and --replay exclude each other: a replay follows its recording; drop one"
        )
    if parameters is None:
        folder = open_experiment(config, problem="no parameters are given")
        # Nothing is given, so the steps of the experiment are meant.
        if all(option is None for option in (output, run, reference, replay)):
            run_stages(context, folder, "simulate", "replay", again=again)
            return
        parameters = folder.step("identify").target
    if output is None:
        output = open_experiment(config, problem="-o: missing").out / "simulated"
        if replay:
            output /= f"replay-{replay.stem}.parquet"
    settings = settings_in_force(config)
    table = PARAMETERS.read(parameters)
    if replay:
        _replay(table, replay, settings, output)
    else:
        _track(table, run or _default_run(table), reference, settings, output)


def _default_run(table: "Table") -> str:
    """Return the model's kind of run; with_human if it has both."""
    kinds = set(table.frame["run"])
    return "exo_alone" if "exo_alone" in kinds and "with_human" not in kinds else "with_human"


def _track(
    table: "Table", run: str, reference: Path | None, settings: "Experiment", output: Path
) -> None:
    from pipelines.contracts import SIMULATION
    from pipelines.contracts.atomic import write_text
    from pipelines.dynamics.plant import plant_from_table
    from pipelines.dynamics.tracking import track
    from pipelines.errors import InputError
    from pipelines.mechanics.gait import gait
    from pipelines.mechanics.read import geometry_from
    from pipelines.mechanics.trajectory import read_trajectory
    from pipelines.simulation.sweep import sweep
    from pipelines.workflow.graph import LOOP, SWEEP

    chosen = settings.simulate
    plant = plant_from_table(table, run, geometry_from(settings))
    passive = [joint.name for joint in plant.joints if joint.is_passive]
    if passive:
        raise InputError(
            f"{table.path}: {passive[0]} has no drive, expected one at every joint for a"
            " controller; give --replay to simulate under a recorded torque"
        )
    if not reference and not plant.machine.is_exoskeleton:
        raise InputError(
            f"{table.path} is of {', '.join(plant.machine.names)}, expected hip and knee: the gait"
            " is a leg's; name what to follow with --reference"
        )
    wanted = read_trajectory(reference) if reference else gait()
    with console.working("simulating"):
        loop = track(plant, chosen, wanted)
    # A loop that diverges has no error worth a table.
    if loop.ran_away:
        raise InputError(
            f"{loop.ran_away}: the loop is unstable, or the disturbance stronger than the drives;"
            " lower simulate.adaptation_gain or simulate.disturbance_nm, or shorten"
            " simulate.step_s"
        )
    with console.working("sweeping the feedback gain"):
        gains = sweep(plant, chosen, wanted, chosen.sweep_nm_s_rad)
    frame = loop.frame()
    SIMULATION.write(output / LOOP, frame, _about_loop(table, plant, reference, settings))
    if len(gains):
        write_text(output / SWEEP, gains.to_csv(index=False))
    if chosen.figures:
        from pipelines.simulation.figures import draw_sweep, draw_tracking

        limits = chosen.torque_limit_nm, chosen.settled_after_s
        with console.working("drawing"):
            draw_tracking(frame, plant.joints, output, *limits)
            if len(gains):
                draw_sweep(gains, plant.joints, output, chosen.feedback_gain_nm_s_rad)
    _report_loop(loop, gains, plant.joints, chosen.settled_after_s)
    tables = [LOOP, *([SWEEP] if len(gains) else [])]
    drawn = ["tracking.png", "error.png", "torque.png", *(["kv-sweep.png"] if len(gains) else [])]
    console.wrote(output, *tables, *(drawn if chosen.figures else []))
    for guess in plant.guesses:
        console.warn(guess)


def _about_loop(
    table: "Table", plant: "Plant", reference: Path | None, settings: "Experiment"
) -> dict[str, Any]:
    """Return the metadata of the adaptive loop's table."""
    from pipelines.contracts import describe

    chosen = settings.simulate
    inputs = [path for path in (table.path, reference) if path]
    config = settings.sections_about(plant.machine.is_exoskeleton, "simulate", "mechanism")
    return describe(inputs, config) | {
        "joints": plant.machine.joint_metadata,
        "plant": plant.metadata(),
        "controller": {"type": "rbf", "reference": reference.name if reference else "gait"},
        "disturbance": {
            "amplitude_nm": chosen.disturbance_nm,
            "omega_rad_s": chosen.disturbance_rad_s,
        },
        "noise": {
            "counts_per_turn": chosen.encoder_counts_per_turn,
            "angle_rad": chosen.encoder_noise_rad,
        },
        "seed": chosen.seed,
    }


def _report_loop(
    loop: "ClosedLoop", gains: "DataFrame", joints: "tuple[Joint, ...]", settled_after_s: float
) -> None:
    """Print each joint's largest error and torque in the adaptive loop."""
    from pipelines.contracts.joints import either

    names = [joint.name for joint in joints]
    errors = dict(zip(names, loop.worst_error(settled_after_s).tolist(), strict=True))
    torques = dict(zip(names, abs(loop.run.torque).max(axis=0).tolist(), strict=True))
    result = {"largest_error_rad": errors, "peak_torque_nm": torques}
    console.emit(result | {"sweep": gains.to_dict("records")})
    angle, torque = (either(j.unit(q) for j in joints) for q in ("angle", "torque"))
    settled = f"largest error after {settled_after_s:g} s ({angle})"
    strongest = f"peak torque ({torque})"
    rows = [(name, f"{errors[name]:.4f}", f"{torques[name]:.1f}") for name in names]
    console.table(("joint", settled, strongest), rows, numbers=f"{settled}, {strongest}")


def _replay(table: "Table", recording: Path, settings: "Experiment", output: Path) -> None:
    from pipelines.contracts import SIMULATION, describe
    from pipelines.dynamics.plant import plant_from_table
    from pipelines.dynamics.replay import WINDOW_S, replay
    from pipelines.errors import InputError
    from pipelines.mechanics.even_grid import on_even_grid
    from pipelines.mechanics.read import geometry_from, read_motion
    from pipelines.simulation import recorded

    motion = on_even_grid(read_motion(recording, settings.filter, geometry_from(settings)))
    plant = plant_from_table(table, motion.run, motion.geometry, recording)
    with console.working(f"replaying {recording.name}"):
        replayed = replay(plant.model, motion)
    if not all(map(isfinite, replayed.rmse.tolist())):
        raise InputError(
            f"{recording}: its simulation with {table.path} diverges within {WINDOW_S:g} s;"
            " identify again from richer motions, and check parameters whose interval contains 0"
            " (`exoid show`)"
        )
    open_loop, closed_loop = recorded.open_loop_frame(replayed, motion, plant.joints), None
    inputs = [path for path in (table.path, recording) if path]
    config = settings.sections_about(plant.machine.is_exoskeleton, "filter", "mechanism")
    about = {"joints": motion.machine.joint_metadata, "plant": plant.metadata()}
    shared = describe(inputs, config) | about
    names = [joint.name for joint in plant.joints]
    rmse = dict(zip(names, replayed.rmse.tolist(), strict=True))
    result: dict[str, Any] = {"simulation_rmse_rad": rmse}
    no_closed_loop = recorded.why_no_closed_loop(motion)
    # A file of its own, as its rows are another simulation of the same run.
    closed_loop_file = output.with_name(f"{output.stem}-closed-loop{output.suffix}")
    about_replay = {
        "simulation_rmse_rad": rmse,
        "windows": len(replayed.first),
        "beside": [] if no_closed_loop else [closed_loop_file.name],
    }
    SIMULATION.write(output, open_loop, shared | about_replay)
    if not no_closed_loop:
        with console.working("following the references"):
            loop = recorded.follow_references(plant, motion)
        closed_loop = recorded.closed_loop_frame(loop, motion, plant.joints)
        scores = {
            "closed_loop_rmse_rad": dict(zip(names, loop.angle_rmse.tolist(), strict=True)),
            "closed_loop_rmse_nm": dict(zip(names, loop.torque_rmse.tolist(), strict=True)),
        }
        result |= scores
        about_loop = scores | {"controller": motion.metadata["controller"]}
        SIMULATION.write(closed_loop_file, closed_loop, shared | about_loop)
    if settings.simulate.figures:
        from pipelines.simulation.figures import draw_replay

        with console.working("drawing"):
            draw_replay(
                open_loop, closed_loop, plant.joints, output.with_suffix(""), recording.stem
            )
    console.emit(result | ({"no_closed_loop": no_closed_loop} if no_closed_loop else {}))
    _report_replay(result, plant.joints)
    if no_closed_loop:
        console.warn(f"no closed loop for {recording}: {no_closed_loop}")
    written = [output.name, *([] if no_closed_loop else [closed_loop_file.name])]
    if settings.simulate.figures:
        written += [Path(name).with_suffix(".png").name for name in written]
    console.wrote(output.parent, *written)
    for guess in plant.guesses:
        console.warn(f"{guess}. The errors contain the difference")


def _report_replay(result: dict[str, Any], joints: "tuple[Joint, ...]") -> None:
    from pipelines.contracts.joints import either

    angle = either(joint.unit("angle") for joint in joints)
    torque = either(joint.unit("torque") for joint in joints)
    headings = {
        "simulation_rmse_rad": f"1 s windows ({angle})",
        "closed_loop_rmse_rad": f"closed loop ({angle})",
        "closed_loop_rmse_nm": f"closed loop ({torque})",
    }
    shown = {key: heading for key, heading in headings.items() if key in result}
    rows = [(one.name, *(f"{result[key][one.name]:.4g}" for key in shown)) for one in joints]
    title, numbers = "root mean square of simulated less recorded", ", ".join(shown.values())
    console.table(("joint", *shown.values()), rows, title=title, numbers=numbers)
