"""The tables of docs/real-data.md."""

from collections.abc import Iterable, Mapping, Sequence
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from pipelines.contracts.verdict import Cause, EffectAtJoint
from pipelines.mechanics.motion import Motion
from pipelines.wording.label import effect_of_cause
from tests.campaigns.real.machines import LOGS, Diagnosed, of_purpose, symmetric, with_rotor
from tests.campaigns.real.published import EMPS, EMPS_ERRORS, double_pendulum, their_torque
from tests.campaigns.real.relative_error import (
    TorqueError,
    decimated_error,
    error_by_place,
    fitted,
    slow_error,
    slow_fit,
)

SHIFTS_S = np.linspace(-0.012, 0.012, 13)
"""Shifts of a prediction along the stamps; positive if the angles are older than their stamps."""

RUNS = ("without pulses", "with pulses")


def table(headings: Sequence[str], rows: Iterable[Sequence[str]]) -> str:
    """Return a table as Markdown has it."""
    lines = [f"| {' | '.join(headings)} |", f"|{'---|' * len(headings)}"]
    return "\n".join([*lines, *(f"| {' | '.join(row)} |" for row in rows)])


def verdicts(diagnoses: Mapping[str, Diagnosed]) -> str:
    """Return the verdict on each machine."""
    headings = (
        "machine",
        "verdict",
        "named (probability)",
        "torque error, rigid + friction",
        "with the causes",
    )
    return table(headings, (_verdict(LOGS[name].title, d) for name, d in diagnoses.items()))


def _verdict(title: str, d: Diagnosed) -> tuple[str, ...]:
    verdict = d.verdict
    causes = [f"{_label(c)} ({c['probability']:.2f})" for c in verdict["causes"]]
    units = {joint: unit["torque"] for joint, unit in verdict["units"].items()}

    def errors(key: str) -> str:
        return ", ".join(f"{verdict[key][joint]:.3g} {unit}" for joint, unit in units.items())

    return (
        title,
        verdict["status"],
        "; ".join(causes) or "–",
        errors("baseline_rmse_nm"),
        errors("extended_rmse_nm"),
    )


def _label(cause: Mapping[str, Any]) -> str:
    """Return a cause's label and those of what could stand in its place."""
    effects = [effect_of_cause(one) for one in Cause.model_validate(cause).with_ties]
    return " or ".join("per-run " * effect.each_run + effect.label for effect in effects)


def emps(diagnoses: Mapping[str, Diagnosed]) -> str:
    """Return parameters and errors next to the published ones."""
    d = diagnoses["emps"]
    (train,), (pulses,) = of_purpose(d.motions, "train"), of_purpose(d.motions, "validate")
    plain, named = symmetric(d)[train.file], d.identified()[train.file]
    values = dict(
        zip((p.symbol for _, p in plain.linear_parameters), plain.linear_values, strict=True)
    )
    rows = [
        (
            symbol,
            f"{theirs:.4f}",
            f"{values[symbol]:.4f}",
            f"{100 * (values[symbol] / theirs - 1):+.2f} %",
        )
        for symbol, theirs in EMPS.items()
    ]
    lines = [
        ("symmetric friction", plain, "symmetric"),
        ("symmetric friction, fitted behind this filter", fitted(plain, train), "symmetric"),
        ("named cause, values of the diagnosis", d.model, "asymmetric"),
        ("named cause, refitted by identify", named, "asymmetric"),
        ("named cause, refitted behind this filter", fitted(d.model, train), "asymmetric"),
    ]
    where = [
        (
            title,
            *(f"{error:.2f}" for run in (train, pulses) for error in error_by_place(model, run)),
        )
        for title, model, _ in lines
    ]
    errors = [
        (
            title,
            f"{decimated_error(model, train).percent[0]:.2f} % ({EMPS_ERRORS[kind][0]:.2f} %)",
            f"{decimated_error(model, pulses).percent[0]:.2f} % ({EMPS_ERRORS[kind][1]:.2f} %)",
        )
        for title, model, kind in lines
    ]
    return "\n\n".join(
        [
            table(("parameter", "published", "found", "difference"), rows),
            table(
                ("model", "relative error (asked for)", "cross-validation, pulses (asked for)"),
                errors,
            ),
            table(
                (
                    "error, N rms",
                    *(f"{run}, {at}" for run in RUNS for at in ("at reversals", "away")),
                ),
                where,
            ),
        ]
    )


def pendulum(diagnoses: Sequence[Diagnosed], published: Path) -> str:
    """Return the torque error of every run of a double pendulum, with that of its makers."""
    theirs = double_pendulum(published)
    rows = []
    for d in diagnoses:
        trained = of_purpose(d.motions, "train")
        plain, refitted = slow_fit(with_rotor(d.motions[0]), trained), d.identified()
        for motion in d.motions:
            lines = [
                *(
                    slow_error(torque, motion)
                    for torque in (their_torque(theirs, motion), plain.torque(motion))
                ),
                d.error_on(motion),
                slow_error(refitted[motion.file].torque(motion), motion),
            ]
            errors = [text for error in lines for text in _both(error)]
            rows.append((motion.file.removesuffix(".parquet"), motion.purpose, *errors))
    models = ("published", "least squares", "extended", "refitted")
    headings = ("run", "for", *(f"{model}, {unit}" for model in models for unit in ("N·m", "%")))
    return table(headings, rows)


def sizes(d: Diagnosed, of: str) -> str:
    """Return the parameters of the ``known`` effects or the named ``causes``."""
    rows = [
        (
            EffectAtJoint.model_validate(one).label,
            p["name"],
            _sized(p, ".3g"),
            " … ".join(f"{end:.3g}" for end in p["ci95"]),
        )
        for one in d.verdict[of]
        for p in one["parameters"]
    ]
    return table((of.removesuffix("s"), "parameter", "found", "95 % interval"), rows)


def _sized(parameter: Mapping[str, Any], digits: str) -> str:
    return f"{parameter['value']:{digits}}" + f" {parameter['unit']}" * (parameter["unit"] != "1")


def by_order(d: Diagnosed) -> str:
    """Return the error on the held-out run by the order of the 5 Hz low-pass."""
    trained, (held_out,) = of_purpose(d.motions, "train"), of_purpose(d.motions, "validate")
    rows = []
    for order in (1, 2, 3, 4):
        plain = slow_fit(with_rotor(trained[0]), trained, order)
        errors = [
            slow_error(plain.torque(motion), motion, order).percent
            for motion in (*trained, held_out)
        ]
        for model in (d.model_of(held_out), d.refitted(order)[held_out.file]):
            errors.append(slow_error(model.torque(held_out), held_out, order).percent)
        rows.append((str(order), *(" / ".join(f"{e:.1f}" for e in error) for error in errors)))
    headings = (
        "order of the filter",
        "least squares, 70 %, %",
        "least squares, %",
        "extended, %",
        "refitted, %",
    )
    return table(headings, rows)


def turning(d: Diagnosed) -> str:
    """Return the verdict's caveats on friction at reversals."""
    return (
        "\n>\n".join(f"> But {caveat}." for caveat in d.verdict["caveats"] if "reversals" in caveat)
        or "> Nothing."
    )


def _both(error: TorqueError) -> tuple[str, str]:
    return " / ".join(f"{e:.3f}" for e in error.rms), " / ".join(f"{e:.1f}" for e in error.percent)


def of_each_run(d: Diagnosed) -> str:
    """Return each run's own values of the named causes."""
    own = [cause for cause in d.verdict["causes"] if cause["each_run"]]
    headings = [
        f"{name} of {EffectAtJoint.model_validate(cause).label}, {unit}"
        for cause in own
        for name in cause["each_run"][0]["values"]
        for unit in [p["unit"] for p in cause["parameters"] if p["name"] == name]
    ]
    rows = [
        (
            one["file"].removesuffix(".parquet"),
            one["purpose"],
            *(f"{v:+.3f}" for cause in own for v in cause["each_run"][k]["values"].values()),
        )
        for k, one in enumerate(own[0]["each_run"])
    ]
    return table(("run", "for", *headings), rows)


def with_zeros(d: Diagnosed, file: Path) -> str:
    """Return the makers' error on each run without and with the zeros of the diagnosis."""
    theirs, rows = double_pendulum(file), []
    for motion in d.motions:
        model = d.model_of(motion)
        zeroed = replace(model.sensed(motion), torque=model.delivered(motion))
        errors = [slow_error(their_torque(theirs, moved), moved) for moved in (motion, zeroed)]
        rows.append(
            (
                motion.file.removesuffix(".parquet"),
                *(_both(e)[0] for e in (*errors, d.error_on(motion))),
            )
        )
    return table(
        ("run", "published, N·m", "published, with these zeros, N·m", "extended, N·m"), rows
    )


def timing(diagnoses: Mapping[str, Diagnosed]) -> str:
    """Return the shift of the predicted torque at which each run's error is least."""
    rows = []
    for d in diagnoses.values():
        for motion in d.motions if len(d.motions[0].joints) == 2 else []:
            predicted = d.model_of(motion).torque(motion)
            errors = np.array(
                [slow_error(_shifted(predicted, motion, s), motion).rms for s in SHIFTS_S]
            )
            best = errors.argmin(axis=0)
            gain = 1.0 - errors.min(axis=0) / errors[len(SHIFTS_S) // 2]
            shifts = " / ".join(f"{1e3 * SHIFTS_S[b]:+.0f} ms" for b in best)
            rows.append(
                (
                    motion.file.removesuffix(".parquet"),
                    shifts,
                    " / ".join(f"{100 * g:.1f} %" for g in gain),
                )
            )
    return table(("run", "shift of the least error", "error reduction"), rows)


def _shifted(torque: NDArray, motion: Motion, by_s: float) -> NDArray:
    return np.column_stack(
        [np.interp(motion.time + by_s, motion.time, column) for column in torque.T]
    )


def depends(d: Diagnosed, most: int = 4) -> str:
    """Return the residual's dependences, before and after, the strongest after first."""
    rows = []
    for joint, variables in d.verdict["depends_on"].items():
        remaining = sorted(variables, key=lambda one: -one["share_after"])[:most]
        rows += [
            (joint, v["variable"], f"{v['share_before']:.2f}", f"{v['share_after']:.2f}")
            for v in remaining
        ]
    return table(("joint", "variable", "share predicted before", "share predicted after"), rows)


def flexibility(d: Diagnosed) -> str:
    """Return force error, acceleration error and simulation error of both runs."""
    (train,), (pulses,) = of_purpose(d.motions, "train"), of_purpose(d.motions, "validate")
    rows = []
    for title, motion in zip(RUNS, (train, pulses), strict=True):
        residual = (motion.torque - d.model.torque(motion))[motion.valid, 0]
        mass = dict(
            zip(
                (p.symbol for _, p in d.model.linear_parameters), d.model.linear_values, strict=True
            )
        )["X1"]
        acceleration = motion.ddq[motion.valid, 0]
        share = 100.0 * np.linalg.norm(residual) / mass / np.linalg.norm(acceleration)
        replayed = d.strayed(motion)
        rows.append(
            (
                title,
                f"{np.sqrt(np.mean(residual**2)):.2f} N",
                f"{share:.1f} %",
                f"{1e3 * replayed[0]:.2f} mm",
            )
        )
    return table(("run", "force error at full rate", "acceleration error", "1 s simulation"), rows)
