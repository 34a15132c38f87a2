"""A verdict as text: missing physics, its probability, the torque errors, and each cause."""

from collections.abc import Iterable, Sequence
from itertools import chain
from textwrap import wrap
from typing import TYPE_CHECKING

from exoid_cli.console import console

if TYPE_CHECKING:
    from pipelines.contracts import Joint
    from pipelines.contracts.verdict import Cause, Control, Parameter, Verdict


def show_verdict(verdict: "Verdict", joints: "Sequence[Joint]") -> None:
    """Print a verdict about a machine of these joints."""
    from pipelines.contracts.joints import HIP_AND_KNEE

    console.say(verdict.summary)
    _show_findings(verdict)
    _show_faults(verdict)
    for caveat in verdict.caveats:
        console.say(f"\nBut {caveat}.")
    _show_router(verdict)
    _show_detection_lines(verdict)
    _show_errors(verdict, joints)
    for known in verdict.known:
        console.say(f"\n{known.label}, assumed present")
        for parameter in known.parameters:
            console.note(_in_words(parameter))
    for cause in verdict.causes:
        _show_cause(cause)
    # The gait that would be followed is a leg's.
    if verdict.causes and tuple(joints) == HIP_AND_KNEE:
        _show_control(verdict.control)


def _show_faults(verdict: "Verdict") -> None:
    """List the faults of acquisition; the summary names only the first."""
    faults = verdict.data_faults
    if verdict.acquisition_at_fault:
        console.say("\nNo cause was sought. Correct the acquisition, or accept it.")
    else:
        # Those with a proof are among the caveats.
        faults = [fault for fault in faults if fault.proof is None]
    if len(faults) < 2:
        return
    console.say("\nFaults of acquisition")
    most = 5
    for fault in faults[:most]:
        console.note(f"- {fault.file}, {fault.channel}: {fault.what}")
    if len(faults) > most:
        console.note(f"- {len(faults) - most} more, in data_faults of verdict.json")


def _show_findings(verdict: "Verdict") -> None:
    """Print the probability that something is missing, and the path to its cause."""
    from pipelines.wording import findings

    cases, tree = findings.outcomes(verdict), findings.rows(verdict)
    if not cases:
        return
    shown = [_broken(row.words, row.depth) for row in tree]
    missing = "is anything missing?"
    which = "what is missing, and where"
    # One width for both tables, so that their probabilities stand in one column.
    width = max(map(len, chain([missing, which], *shown)))
    tables = {
        missing: [(case.words, case.probability) for case in cases],
        which: [("\n".join(s), row.probability) for s, row in zip(shown, tree, strict=True)],
    }
    for heading, lines in tables.items():
        if lines:
            rows = [(words, f"{probability:.2f}") for words, probability in lines]
            console.say("")
            console.table((heading.ljust(width), "probability"), rows, numbers="probability")


def _broken(words: str, depth: int) -> list[str]:
    """Return indented lines that leave room for the probability."""
    indent = "  " * depth
    room = console.out.width - len("  probability")
    return wrap(words, room, initial_indent=indent, subsequent_indent=f"{indent}    ")


def _show_router(verdict: "Verdict") -> None:
    """Print the parts of each joint's residual, and the variables it depends on."""
    from pipelines.wording.findings import searched_runs, shares

    joints = shares(verdict)
    if not joints or verdict.acquisition_at_fault:
        return
    # A part that is zero at every joint has no column.
    part_headings = {
        "noise": "noise",
        "repeats": "repeats",
        "wanders": "wanders",
        "between_runs": "per run",
        "unsplit": "beyond noise",
    }
    parts = {
        part: words
        for part, words in part_headings.items()
        if any(one.parts[part] for one in joints)
    }
    variables = list(joints[0].predicted)
    headings = ("joint", *parts.values(), *variables)
    rows = []
    for one in joints:
        of_joint = [one.parts[part] for part in parts] + [one.predicted[name] for name in variables]
        rows.append((one.joint, *(f"{share:.0%}" for share in of_joint)))
    _show_table("where the error of rigid body and friction comes from", headings, rows)
    console.note(
        f"{_listed(parts.values())}: parts of the mean square, {searched_runs(verdict)}. "
        f"{_listed(variables)}: share that a curve of it alone predicts, validation runs."
    )


def _show_detection_lines(verdict: "Verdict") -> None:
    """Print what the lines show that the motion leaves empty."""
    from pipelines.wording.detection_lines import HEADINGS, notes, rows

    if verdict.detection_lines:
        title = "what repeats at the lines of the motion, and at those that it leaves empty"
        _show_table(title, HEADINGS, rows(verdict))
        for note in notes(verdict):
            console.note(note)


def _listed(words: Iterable[str]) -> str:
    *most, last = words
    return f"{', '.join(most)} and {last}" if most else last


def _show_errors(verdict: "Verdict", joints: "Sequence[Joint]") -> None:
    from pipelines.contracts.joints import HIP_AND_KNEE, either
    from pipelines.wording.increased_errors import increased_errors

    digits = ".3f" if tuple(joints) == HIP_AND_KNEE else ".4g"
    error_headings = {
        "torque_rms_nm": "measured",
        "noise_floor_nm": "noise floor",
        "baseline_rmse_nm": "rigid + friction",
        "extended_rmse_nm": "with the causes",
    }
    # Files of older versions lack one of these errors.
    errors = {key: words for key, words in error_headings.items() if getattr(verdict, key)}
    if not verdict.causes:
        del errors["extended_rmse_nm"]
    headings, rows = ["joint", *errors.values()], []
    for joint in (joint for joint in joints if joint.is_measured):
        numbers = [f"{getattr(verdict, key)[joint.name]:{digits}}" for key in errors]
        rows.append([joint.name, *numbers])
    if verdict.causes:
        headings.append("excess left")
        for row in rows:
            share = verdict.unexplained[row[0]]
            row.append("at the floor" if share is None else f"{share:.0%}")
    effort = either(joint.effort for joint in joints)
    unit = either(joint.unit("torque") for joint in joints)
    _show_table(
        f"{effort} error on data no fit has seen, away from reversals, {unit}", headings, rows
    )
    for sentence in increased_errors(verdict, joints):
        console.note(f"{sentence}.")


def _show_table(title: str, headings: Sequence[str], rows: Sequence[Sequence[str]]) -> None:
    """Print a table whose columns are numbers but for the first."""
    console.say("")
    console.table(headings, rows, title=title, numbers=", ".join(headings[1:]))


def _show_cause(cause: "Cause") -> None:
    from pipelines.contracts.joints import the
    from pipelines.wording.causes import cause_in_words

    where = f" at {the(cause.joint)}" if cause.joint else ""
    likely = f"probability {cause.probability:.2f}"
    together = " with its ties" if cause.indistinguishable_from else ""
    console.say(f"\n{cause.effect}{where} ({cause.side}), {likely}{together}")
    of = next((f", of {one.file}" for one in cause.each_run), "")
    for p in cause.parameters:
        console.note(_in_words(p) + of * (p.name in cause.fitted_on_validate))
    for sentence in cause.evidence:
        console.note(f"- {sentence}")
    for tie in cause.indistinguishable_from:
        console.note(f"or {cause_in_words(tie)}: {tie.why}; {tie.how_to_separate}")


def _in_words(parameter: "Parameter") -> str:
    """Return a parameter with its interval; an assumed or chosen value has none."""
    low, high = parameter.ci95
    unit = "" if parameter.unit == "1" else f" {parameter.unit}"
    # An interval of no width is of a value that was chosen or assumed.
    interval = "taken, not fitted" if low == high else f"{low:.4g} … {high:.4g}"
    return f"{parameter.name} {parameter.value:.4g}{unit} ({interval})"


def _show_control(control: "Control") -> None:
    """Print tracking error and peak torque under adaptive control, without and with the causes."""
    before, after = control.without, control.with_
    if control.reason or before is None or after is None:
        console.say(f"\nUnder adaptive control: not compared, {control.reason}.")
        return
    headings = ("joint", "error mrad", "error with", "peak N·m", "peak with")
    rows = []
    for joint in after.tracking_rmse_rad:
        errors = [f"{1e3 * loop.tracking_rmse_rad[joint]:.2f}" for loop in (before, after)]
        peaks = [f"{loop.peak_torque_nm[joint]:.1f}" for loop in (before, after)]
        rows.append((joint, *errors, *peaks))
    title = "tracking error and peak torque under adaptive control, without and with the causes"
    _show_table(title, headings, rows)
    console.note("Predicted by simulation. The model with the causes may predict worse tracking.")
