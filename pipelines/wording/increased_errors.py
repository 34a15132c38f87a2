"""Put into words which errors the named causes increase, and why."""

from collections.abc import Iterator, Sequence

from pipelines.contracts import Joint
from pipelines.contracts.joints import the
from pipelines.contracts.verdict import Verdict
from pipelines.model import BY_NAME
from pipelines.wording.numbers import digits


def increased_errors(verdict: Verdict, joints: Sequence[Joint]) -> list[str]:
    """Return a sentence for each error that the causes increase, with the reason if known.

    Parameters
    ----------
    verdict : Verdict
    joints : sequence of Joint
        Of the verdict's machine.
    """
    if not verdict.causes:
        return []
    return [sentence for joint in joints for sentence in _at(joint, verdict)]


def torque_error_grew(before: float | None, after: float | None = None, *, floor: float) -> bool:
    """Return whether a torque error's mean square grows by more than that of the noise.

    Parameters
    ----------
    before, after : float or None
        RMSE without and with the causes, N·m; None if unknown.
    floor : float
        Noise floor, N·m.
    """
    # Mean squares of independent parts add, so a growth below the noise's own says nothing.
    return before is not None and after is not None and after**2 - before**2 > floor**2


def simulation_error_grew(before: float | None, after: float | None = None) -> bool:
    """Return whether a simulation's error grows by more than a tenth, enough to be mentioned."""
    return before is not None and after is not None and after > 1.1 * before


def _at(joint: Joint, verdict: Verdict) -> Iterator[str]:
    name, effort = joint.name, joint.effort
    if name not in verdict.noise_floor_nm:
        return
    (before, after), (all_before, all_after), (simulated_before, simulated_after) = (
        (getattr(verdict, f"baseline_{key}")[name], getattr(verdict, f"extended_{key}")[name])
        for key in ("rmse_nm", "rmse_unmasked_nm", "simulation_rmse_rad")
    )
    # Effects that hold a standing joint raise its breakaway torque, which explains the growth.
    here = [cause.effect for cause in verdict.causes if cause.joint == name]
    holds = any(BY_NAME[effect].holds for effect in here if effect in BY_NAME)
    grew = torque_error_grew(all_before, all_after, floor=verdict.noise_floor_nm[name])
    if grew:
        yield (
            f"Reversals included, {the(name)}'s {effort} error is {digits(all_before)} →"
            f" {digits(all_after)} {joint.unit('torque')} with the causes, and {digits(before)} →"
            f" {digits(after)} away from them. Any {effort} below breakaway holds a standing joint,"
            " so a model of speed cannot predict it"
            + (f". The named causes raise the breakaway {effort}" if holds else "")
        )
    if simulation_error_grew(simulated_before, simulated_after):
        why = (
            f"such a simulation has no feedback, and a small {effort} error shifts the instant at"
            " which a standing joint breaks free; the report has each run's error without"
            " standstill"
        )
        yield (
            f"Simulated for 1 s with the recorded {effort}, {the(name)}'s error is"
            f" {digits(1e3 * simulated_before)} → {digits(1e3 * simulated_after)}"
            f" m{joint.unit('angle')} with the causes: "
            + (why if grew or holds else "these files do not show the reason")
        )
