"""The numbers of the first screen: probability, gain, remaining error and simulation error."""

from dataclasses import dataclass

from pipelines.contracts import Joint
from pipelines.contracts.joints import the
from pipelines.contracts.verdict import Cause, Verdict
from pipelines.report.sections.error_budget import falls, torque_unit
from pipelines.report.sections.fit_quality import replayed
from pipelines.report.session import Session
from pipelines.wording.causes import cause_in_words
from pipelines.wording.increased_errors import simulation_error_grew
from pipelines.wording.numbers import digits


@dataclass(frozen=True)
class Tile:
    """One number."""

    title: str
    big: str
    unit: str
    small: str
    is_worse: bool = False
    """Whether the number speaks against naming the causes."""


def tiles(session: Session) -> list[Tile]:
    """Return the key figures; none without a verdict."""
    verdict = session.verdict
    if not verdict:
        return []
    # The tree of findings shows each probability; verdicts of older versions have no tree.
    skipped = bool(verdict.findings)
    results = [
        tile for cause in verdict.causes[:2] for tile in _cause_tiles(verdict, cause)[skipped:]
    ]
    for fall in falls(verdict):
        if fall.unexplained is not None:
            after = "" if fall.after is None else f" → {digits(fall.after / fall.floor)}"
            big = f"{digits(fall.before / fall.floor)}{after}"
            results.append(Tile(f"{fall.joint} error", big, "× floor", "1 would be noise alone"))
    return [*results, *_simulation_tiles(session, verdict), *_loop_tiles(session)]


def worst_joint(session: Session) -> Joint | None:
    """Return the joint of the first cause's largest gain, or furthest above its floor."""
    verdict = session.verdict
    if not verdict:
        return None
    # In units of the floor, as torques of different joints cannot be compared.
    before, floor = verdict.baseline_rmse_nm, verdict.noise_floor_nm
    if verdict.causes:
        name = verdict.causes[0].gain.joint
    else:
        name = max(before, key=lambda joint: before[joint] / floor[joint])
    return next((joint for joint in session.joints if joint.name == name), None)


def _cause_tiles(verdict: Verdict, cause: Cause) -> list[Tile]:
    gain, (low, high) = cause.gain.rmse_reduction_nm, cause.gain.ci95
    joint = cause.gain.joint
    remaining = verdict.extended_rmse_nm[joint]
    qualifier = ", given the other causes" if len(verdict.causes) > 1 else ""
    unit, ties = torque_unit(verdict, joint), len(cause.indistinguishable_from)
    words = cause_in_words(cause)
    return [
        Tile(
            "probability" + (", with its ties" if ties else ""),
            f"{100 * cause.probability:.0f}",
            "%",
            words + (f", or one of {ties} that these data cannot separate from it" if ties else ""),
        ),
        Tile(
            f"gain of {words}",
            digits(gain),
            unit,
            f"{digits(remaining + gain)} → {digits(remaining)} {unit} at {the(joint)}{qualifier};"
            f" 95 %: {digits(low)} … {digits(high)}",
        ),
    ]


def _simulation_tiles(session: Session, verdict: Verdict) -> list[Tile]:
    """Return the error of simulations of one second, at the worst joint."""
    joint = worst_joint(session)
    before = verdict.baseline_simulation_rmse_rad.get(joint.name) if joint else None
    if not joint or before is None:
        return []
    after = verdict.extended_simulation_rmse_rad[joint.name] if verdict.causes else None
    big = digits(1e3 * before) + ("" if after is None else f" → {digits(1e3 * after)}")
    is_worse = simulation_error_grew(before, after)
    small = "rms of all runs, as the diagnosis fits them"
    if verdict.causes and after is None:
        small = "without the causes; with them it cannot be simulated"
    elif is_worse:
        small = "worse with the causes; the reason is below"
    return [
        Tile(f"{joint.name}, simulated for 1 s", big, f"m{joint.unit('angle')}", small, is_worse)
    ]


def _loop_tiles(session: Session) -> list[Tile]:
    """Return the drives' simulated torque error, in the run with the largest gain."""
    joint, key = worst_joint(session), "closed_loop_rmse_nm"
    if not joint:
        return []
    pairs = []
    for models in replayed(session, "drives").values():
        replays = [models[name] for name in ("baseline", "extended") if name in models]
        stated = [replay.metadata.get(key, {}) for replay in replays]
        errors = [of_joints[joint.name] for of_joints in stated if joint.name in of_joints]
        # Only runs that both models can follow show a gain.
        if len(errors) == 2:
            pairs.append(errors)
    if not pairs:
        return []
    # One run for both numbers: a mean would mix motions of different size.
    before, after = max(pairs, key=lambda pair: pair[0] - pair[1])
    is_worse = after > before
    small = "worse with the causes" if is_worse else f"rms error of the simulated {joint.effort}"
    big, unit = f"{digits(before)} → {digits(after)}", joint.unit("torque")
    return [Tile(f"{joint.name}, in the drives' loop", big, unit, small, is_worse)]
