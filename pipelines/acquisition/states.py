"""The states of a run, and which may follow which; docs/safety.md draws them."""

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


TRANSITIONS = {
    State.IDLE: {State.CHECK},
    State.CHECK: {State.RAMP, State.ABORT},
    State.RAMP: {State.RUN, State.ABORT},
    State.RUN: {State.RAMP_DOWN, State.ABORT},
    State.RAMP_DOWN: {State.DISABLED, State.ABORT},
    State.ABORT: {State.DISABLED},
    State.DISABLED: set[State](),
}
"""Where each state may lead. Abort and disabled lead to no set-point of the plan any more."""

FOLLOWING = (State.RAMP, State.RUN, State.RAMP_DOWN)
"""The states in which the drives are sent the plan, in its order."""
