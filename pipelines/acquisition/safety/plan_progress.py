"""Where a run is on its plan: which set-points are due at a cycle of the machine.

The path is the plan's set-points after the place where the leg stood. A set-point that is sent
while a sample is latched is reached at the end of the next one.
"""

from collections.abc import Sequence

import numpy as np
from numpy.typing import NDArray

from pipelines.acquisition.machine.row import Row
from pipelines.acquisition.plan import Plan
from pipelines.acquisition.safety.return_to_plan import Path
from pipelines.acquisition.safety.set_point_tracker import SetPointTracker
from pipelines.acquisition.states import State
from pipelines.errors import DeviceError


class PlanProgress:
    """The plan of a run, along the machine's cycles; instants ``now`` are the host's clock, s."""

    def __init__(self, plan: Plan, start: NDArray, rate_hz: float) -> None:
        """Follow a plan from where the leg stood when it was made, (J,) rad."""
        self._plan, self._start, self._rate_hz = plan, start, rate_hz
        self._length = len(plan.reference)
        self._end: list[float] = self._at(self._length).tolist()
        self._first_cycle = 0
        self.cycle, self.followed_at = 0, 0.0
        """The cycle at which the plan was followed last, and when."""
        self.has_advanced = True
        """Whether that is another cycle than before: there is one step a cycle."""

    def begin(self, cycle: int, now: float) -> None:
        """Begin to follow the plan at a cycle."""
        self._first_cycle = self.cycle = cycle
        self.followed_at = now

    def advance(self, cycle: int, now: float) -> None:
        """Go on to the set-point that is due at a cycle."""
        self.has_advanced = cycle > self.cycle
        self.cycle, self.followed_at = cycle, now

    def due(self, joint: int, cycle: int) -> Path:
        """Return a joint's set-points due at a cycle and at the two before it.

        Parameters
        ----------
        joint : int
            Number of the joint.
        cycle : int
            Cycle of the machine.

        Returns
        -------
        Path
            Three set-points, rad, the newest first.
        """
        now, before, earlier = (self._at(self._index(cycle - back)) for back in range(3))
        return float(now[joint]), float(before[joint]), float(earlier[joint])

    def state(self, cycle: int) -> State:
        """Return the state to which the set-point due at a cycle belongs."""
        index = self._index(cycle) - 1
        if index < self._plan.first:
            return State.RAMP
        return State.RUN if index < self._plan.stop else State.RAMP_DOWN

    def is_finished(self, row: Row, trackers: Sequence[SetPointTracker]) -> bool:
        """Return whether the set-points are at the end of the plan, but for a count.

        Raises
        ------
        DeviceError
            They are long overdue: more samples are lost than the way back makes up for.
        """
        # How long set-points may take to the end of their path once it is due.
        longest_return_s = 5.0
        cycles_past_end = row.sequence - self._first_cycle - self._length
        if cycles_past_end > longest_return_s * self._rate_hz:
            raise DeviceError(
                f"the motion is {longest_return_s:g} s late and still not finished: too many"
                " samples are lost; check the line, and the drives' sample counters"
            )
        pairs = zip(trackers, self._end, strict=True)
        at_end = [abs(tracker.sent - angle) <= tracker.resolution for tracker, angle in pairs]
        return cycles_past_end > 0 and all(at_end)

    def set_point(self, row: Row) -> int:
        """Return which set-point of the plan a sample carries; it may be outside the plan."""
        # Set-point 0 is sent at the cycle after the first one, and reached at the end of the next.
        return row.sequence - self._first_cycle - 2

    def sample(self, row: Row) -> int:
        """Return how many samples of its drives a row is after the beginning of the recording.

        Set-point m of the plan is reached 2 + m cycles after the first. Time 0 is where the
        trajectory begins, half a cycle before the plan's first set-point is reached.
        """
        cycle = row.samples_per_cycle
        reached = row.drives[0].sequence - (self._first_cycle + 2) * cycle
        return reached - (self._plan.first - 1) * cycle - cycle // 2 - 1

    def _at(self, index: int) -> NDArray:
        """Return the set-points (J,) rad of the path; its first is where the leg stood."""
        return np.asarray(self._plan.reference[index - 1] if index else self._start)

    def _index(self, cycle: int) -> int:
        """Return which set-point of the path is due at a cycle."""
        # Before the first cycle the path is at rest; after the last it stays at its end.
        return min(max(cycle - self._first_cycle, 0), self._length)
