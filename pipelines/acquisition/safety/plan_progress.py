"""Where a run is on its plan: which set-points are due at a cycle of the machine.

The path is the plan's set-points after the place where the leg stood. What is sent while a sample
is latched is reached at the end of the next one.
"""

import numpy as np
from numpy.typing import NDArray

from pipelines.acquisition.machine.row import Row
from pipelines.acquisition.plan import Plan
from pipelines.acquisition.states import State


class PlanProgress:
    """The plan of a run, along the machine's cycles."""

    def __init__(self, plan: Plan, start: NDArray) -> None:
        """Follow a plan from where the leg stood when it was made, (J,) rad."""
        self.plan, self.start = plan, start
        self.first_cycle = 0

    @property
    def length(self) -> int:
        """Set-points of the plan."""
        return len(self.plan.reference)

    def due(self, joint: int, cycle: int) -> tuple[float, float, float]:
        """Return a joint's set-points due at a cycle and at the two before it, rad."""
        now, before, earlier = (self.at(self._index(cycle - back)) for back in range(3))
        return float(now[joint]), float(before[joint]), float(earlier[joint])

    def state(self, cycle: int) -> State:
        """Return the state to which the set-point due at a cycle belongs."""
        index = self._index(cycle) - 1
        if index < self.plan.first:
            return State.RAMP
        return State.RUN if index < self.plan.stop else State.RAMP_DOWN

    def cycles_past_end(self, row: Row) -> int:
        """Return how many cycles a sample is past the end of the plan."""
        return row.sequence - self.first_cycle - self.length

    def at(self, index: int) -> NDArray:
        """Return the set-points (J,) rad of the path; its first is where the leg stood."""
        return np.asarray(self.plan.reference[index - 1] if index else self.start)

    def set_point(self, row: Row) -> int:
        """Return which set-point of the plan a sample carries; it may be outside the plan."""
        return row.sequence - self.first_cycle - 2

    def sample(self, row: Row) -> int:
        """Return how many samples of its drives a row is after the beginning of the recording.

        Set-point m of the plan is reached 2 + m cycles after the first. Time 0 is where the
        trajectory begins, half a cycle before the plan's first set-point is reached.
        """
        cycle = row.samples_per_cycle
        reached = row.drives[0].sequence - (self.first_cycle + 2) * cycle
        return reached - (self.plan.first - 1) * cycle - cycle // 2 - 1

    def _index(self, cycle: int) -> int:
        """Return which set-point of the path is due at a cycle."""
        return min(max(cycle - self.first_cycle, 0), self.length)
