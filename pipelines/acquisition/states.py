"""The states of a run, their transitions and the conditions; docs/safety.md draws them."""

from collections.abc import Callable, Mapping
from dataclasses import dataclass
from enum import StrEnum


class State(StrEnum):
    """Where a run is."""

    IDLE = "idle"
    CHECK = "check"
    RAMP = "ramp"
    RUN = "run"
    RAMP_DOWN = "ramp down"
    ABORT = "abort"
    DISABLED = "disabled"


FOLLOWING = (State.RAMP, State.RUN, State.RAMP_DOWN)
"""The states in which the drives are sent the plan, in its order."""


@dataclass(frozen=True)
class Conditions:
    """The facts on which the guards of the transitions depend."""

    due: State
    """The state to which the set-point belongs that is due now."""
    all_enabled: bool
    """Whether no drive reports that it is not enabled."""
    all_disabled: bool
    """Whether every drive took it to disable, or was never enabled."""
    reason: str | None
    """Why the run is stopped early, if it is."""


Guard = Callable[[Conditions], bool]


def _always(conditions: Conditions) -> bool:
    return True


def _drives_are_enabled(conditions: Conditions) -> bool:
    return conditions.all_enabled


def _recording_has_begun(conditions: Conditions) -> bool:
    return conditions.due is not State.RAMP


def _recording_is_over(conditions: Conditions) -> bool:
    return conditions.due is State.RAMP_DOWN


def _has_reason(conditions: Conditions) -> bool:
    return conditions.reason is not None


def _drives_are_disabled(conditions: Conditions) -> bool:
    return conditions.all_disabled


TRANSITIONS: Mapping[State, Mapping[State, Guard]] = {
    State.IDLE: {State.CHECK: _always},
    State.CHECK: {State.RAMP: _drives_are_enabled, State.ABORT: _has_reason},
    State.RAMP: {State.RUN: _recording_has_begun, State.ABORT: _has_reason},
    State.RUN: {State.RAMP_DOWN: _recording_is_over, State.ABORT: _has_reason},
    State.RAMP_DOWN: {State.DISABLED: _drives_are_disabled, State.ABORT: _has_reason},
    State.ABORT: {State.DISABLED: _drives_are_disabled},
    State.DISABLED: {},
}
"""Where each state may lead, and the guard of each transition.

Abort and disabled lead to no set-point of the plan any more.
"""


def check_guard(state: State, following: State, conditions: Conditions) -> None:
    """Assert that a state may lead to another one under the conditions."""
    assert following in TRANSITIONS[state], f"there is no way from {state} to {following}"
    guard = TRANSITIONS[state][following]
    assert guard(conditions), f"the way from {state} to {following} is closed: {conditions}"
