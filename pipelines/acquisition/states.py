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


def _has_reason(now: Conditions) -> bool:
    return now.reason is not None


TRANSITIONS: Mapping[State, Mapping[State, Guard]] = {
    State.IDLE: {State.CHECK: lambda now: True},
    State.CHECK: {State.RAMP: lambda now: now.all_enabled, State.ABORT: _has_reason},
    # After missed samples the plan may be past the run already; then the run is passed through.
    State.RAMP: {State.RUN: lambda now: now.due is not State.RAMP, State.ABORT: _has_reason},
    State.RUN: {
        State.RAMP_DOWN: lambda now: now.due is State.RAMP_DOWN,
        State.ABORT: _has_reason,
    },
    State.RAMP_DOWN: {State.DISABLED: lambda now: now.all_disabled, State.ABORT: _has_reason},
    State.ABORT: {State.DISABLED: lambda now: now.all_disabled},
    State.DISABLED: {},
}
"""Where each state may lead, and the guard of each transition."""


def check_guard(state: State, following: State, conditions: Conditions) -> None:
    """Assert that a state may lead to another one under the conditions."""
    assert following in TRANSITIONS[state], f"there is no way from {state} to {following}"
    guard = TRANSITIONS[state][following]
    assert guard(conditions), f"the way from {state} to {following} is closed: {conditions}"
