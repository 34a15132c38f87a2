"""A torque channel whose gain changes during a run."""

from collections.abc import Sequence
from math import exp

import numpy as np
from numpy.typing import NDArray

from pipelines.effects.effect import Effect, Family, Parameter, Side
from pipelines.effects.kernel import torque_reading
from pipelines.mechanics.instant import REFERENCE_C
from pipelines.mechanics.motion import Motion


class GainDrift(Effect):
    """A torque constant that falls as the magnets warm, or a sensor whose gain drifts.

    The gain changes with the time since the run's start, linearly or towards a limit, or with the
    recorded temperature. It is 1 at the run's start and at 25 °C; a temperature that was not
    recorded counts as 25 °C.
    """

    name = "gain_drift"
    title = "Gain drift"
    side = Side.SENSOR
    family = Family.TIME
    needs_torque = True
    resembles = ("gain_over_time", "time")
    forms_differ = "a real gain may recover while the machine rests, and start elsewhere each time"
    equation = (
        "measured torque = (1 + r u(t) + c (T - 25 °C)) * true torque; "
        "u = t, or Tc (1 - exp(-t / Tc)) with a time constant"
    )
    source = "Sebastian (1995), IEEE Trans. Industry Applications 31(2): magnets that warm"
    looks_like = "residual in step with the whole torque that grows or shrinks through the run"
    confirm = "hang a known weight on the joint and read its torque for some minutes"
    shape = (
        Parameter("rate", "1/s", "change of the gain per second at first", "r", (-0.004, 0.004)),
        Parameter(
            "time_constant",
            "s",
            "time in which the change falls to 1/e; 0 for a linear change",
            "Tc",
            (0.0, 120.0),
            default=0.0,
            forms=(0.0, 20.0),
        ),
        Parameter(
            "per_degree",
            "1/°C",
            "change of the gain per degree",
            "c",
            (-0.01, 0.01),
            default=0.0,
        ),
    )

    @torque_reading
    def torque_reading(t, torque, values, joint, state, temperature):
        """Multiply the torque by the present gain."""
        # Both forms begin with the slope 1, so that ``rate`` means the same.
        since = t
        if values[1] > 0.0:
            since = values[1] * (1.0 - exp(-(t / values[1])))
        gain = 1.0 + values[0] * since
        above = temperature[joint] - REFERENCE_C
        # A temperature that was not measured is NaN, which differs from itself.
        if values[2] != 0.0 and above == above:
            gain += values[2] * above
        torque[joint] *= gain

    def directions(self, motions: Sequence[Motion]) -> tuple[tuple[tuple[float, ...], ...], ...]:
        """Return a drift with time in each form, and one with temperature if it was measured."""
        # The gain is linear in its rates: any small ones give the direction.
        with_time = tuple(((0.001, form, 0.0),) for form in self.shape[1].forms)
        with_temperature = (((0.0, 0.0, 0.002),),) if self.temperature_varies(motions) else ()
        return (*with_time, *with_temperature)

    def delivered(self, torque: NDArray, motion: Motion, values: NDArray) -> NDArray:
        """Divide the joint's torque by the present gain.

        Parameters
        ----------
        torque : (n, J) array
            As the sensor reads it, N·m.
        motion : Motion
            n samples.
        values : (3,) array
            Drift with time, 1/s; its time constant, s; drift with temperature, 1/°C.

        Returns
        -------
        (n, J) array
            True torque, N·m.
        """
        # The reading of a unit torque is the gain. Other joints keep their torque.
        true, unit = torque.copy(), np.zeros((*torque.shape, 1))
        unit[:, self.column(motion)] = 1.0
        true /= np.where(unit, self._read(unit, motion, values), 1.0)[:, :, 0]
        return true
