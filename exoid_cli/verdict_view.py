"""A verdict as a person reads it: the sentence, the errors, each cause with its numbers and its evidence."""

from collections.abc import Mapping, Sequence
from typing import TYPE_CHECKING, Any

from exoid_cli.console import console

if TYPE_CHECKING:
    from pipelines.contracts import Joint


ERRORS = {
    "torque_rms_nm": "measured",
    "noise_floor_nm": "noise floor",
    "baseline_rmse_nm": "rigid + friction",
    "extended_rmse_nm": "with the causes",
}


def show_verdict(said: Mapping[str, Any], joints: "Sequence[Joint]") -> None:
    """Print a verdict/1 document about a machine of these joints."""
    from pipelines.contracts.joints import HIP_AND_KNEE, either
    from pipelines.label import cause_label

    console.say(said["summary"])
    for caveat in said["caveats"]:
        console.say(f"But {caveat}.")
    console.say("")
    digits = ".3f" if tuple(joints) == HIP_AND_KNEE else ".4g"
    told = {key: words for key, words in ERRORS.items() if key in said}  # of older files one lacks
    console.table(
        ("joint", *told.values(), "excess left"),
        [
            (joint.name, *(f"{said[key][joint.name]:{digits}}" for key in told), _excess_left(said, joint.name))
            for joint in joints
        ],
        title=f"{either(joint.effort for joint in joints)} error on runs no fit has seen, "
        f"{either(joint.unit('torque') for joint in joints)}",
        numbers=", ".join((*told.values(), "excess left")),
    )
    for told in said.get("known", ()):
        console.say(f"\n{cause_label(told)}, known beforehand")
        for parameter in told["parameters"]:
            console.note(_in_words(parameter))
    for cause in said["causes"]:
        _show_cause(cause)
    if said["causes"] and tuple(joints) == HIP_AND_KNEE:  # the gait that would be followed is a leg's
        _show_control(said["control"])


def _excess_left(said: Mapping[str, Any], joint: str) -> str:
    """Return the share of a joint's error beyond noise that is left; none is told where nothing is missing."""
    share = said["unexplained"][joint]
    if share is None:
        return "at the floor"
    return "too little" if said["status"] == "nothing_missing" else f"{share:.0%}"


def _show_cause(cause: Mapping[str, Any]) -> None:
    from pipelines.contracts.joints import the
    from pipelines.label import cause_label

    where = f" at {the(cause['joint'])}" if cause["joint"] else ""
    console.say(f"\n{cause['effect']}{where} ({cause['side']}), probability {cause['probability']:.2f}")
    of = next((f", of {one['file']}" for one in cause.get("each_run", ())), "")
    for p in cause["parameters"]:
        console.note(_in_words(p) + of * (p["name"] in cause.get("fitted_on_validate", ())))
    for sentence in cause["evidence"]:
        console.note(f"- {sentence}")
    for tie in cause["indistinguishable_from"]:
        per_run = "per-run " * tie.get("per_run", False)
        console.note(f"or {per_run}{cause_label(tie)}: {tie['why']}; {tie['how_to_separate']}")


def _in_words(parameter: Mapping[str, Any]) -> str:
    """Return a parameter with its interval; what was assumed, or chosen among a few values, has none."""
    low, high = parameter["ci95"]
    unit = "" if parameter["unit"] == "1" else f" {parameter['unit']}"
    sure = "taken, not fitted" if low == high else f"{low:.4g} … {high:.4g}"
    return f"{parameter['name']} {parameter['value']:.4g}{unit} ({sure})"


def _show_control(said: Mapping[str, Any]) -> None:
    """Print tracking error and peak torque under adaptive control, without and with the causes."""
    console.say("")
    if said["reason"]:
        console.say(f"Under adaptive control: not compared, {said['reason']}.")
        return
    before, after = said["without"], said["with"]
    headings = ("joint", "error mrad", "error with", "peak N·m", "peak with")
    console.table(
        headings,
        [
            (joint, f"{1e3 * before['tracking_rmse_rad'][joint]:.2f}", f"{1e3 * error:.2f}",
             f"{before['peak_torque_nm'][joint]:.1f}", f"{after['peak_torque_nm'][joint]:.1f}")
            for joint, error in after["tracking_rmse_rad"].items()
        ],
        title="tracking error and peak torque under adaptive control, without and with the causes",
        numbers=", ".join(headings[1:]),
    )  # fmt: skip
    console.note("What each model promises; the one with the causes may well promise worse.")
