"""Torque that repeats with the angle."""

from collections.abc import Collection
from dataclasses import dataclass, replace
from math import cos, sin

import numpy as np
from numpy.typing import NDArray

from pipelines.effects.effect import Effect, Family, Parameter, Parity, Side
from pipelines.effects.kernel import reaction


def _amplitudes(number: str) -> tuple[Parameter, ...]:
    return (
        Parameter(f"sine{number}", "N·m", "amplitude of sin(n q)", "A", (-4.0, 4.0)),
        Parameter(f"cosine{number}", "N·m", "amplitude of cos(n q)", "B", (-4.0, 4.0)),
    )


def _cycles(number: str) -> Parameter:
    meaning = "waves per turn of the joint"
    return Parameter(f"cycles_per_turn{number}", "1/turn", meaning, "n", (4.0, 400.0))


def _reported(number: str) -> tuple[Parameter, ...]:
    return (
        Parameter(f"amplitude{number}", "N·m", "half of peak to peak", "A", (0.3, 4.0)),
        _cycles(number),
        Parameter(
            f"phase{number}",
            "rad",
            "phase of the wave at angle zero",
            "phi",
            (-np.pi, np.pi),
            of_joint=False,
        ),
    )


@dataclass(frozen=True)
class Cogging(Effect):
    """Magnets against slots, teeth against teeth: a ripple fixed to the joint's angle.

    A gear may ripple at up to four unrelated numbers of cycles per turn. Further lines have the
    parameters ``amplitude_2``, ``cycles_per_turn_2``, ``phase_2``, and so on up to ``_4``.
    """

    lines: int = 1
    """Number of its lines."""

    name = "cogging"
    title = "Cogging"
    side = Side.DRIVE
    family = Family.ANGLE
    resembles = ("angle",)
    forms_differ = "a real ripple may depend on the direction of motion, and grow with the load"
    equation = "tau = A sin(n q) + B cos(n q), one such term for each line"
    source = "Holtz, Springob (1996), IEEE TIE 43(2); Tuttle, Seering (1996), IEEE T-RA 12(3)"
    looks_like = "residual against angle: a wave that is the same forward and backward"
    confirm = "move the joint slowly and evenly, plot torque against angle, and count the waves"
    linear = _amplitudes("")
    shape = (_cycles(""),)
    reported = _reported("")
    parity = Parity.EVEN
    order_tracked = True
    most_parts = 4

    def __post_init__(self) -> None:
        """Use the parameters of all lines."""
        numbers = ["", *(f"_{k}" for k in range(2, self.lines + 1))]
        if len(numbers) > 1:
            linear = tuple(p for number in numbers for p in _amplitudes(number))
            reported = tuple(p for number in numbers for p in _reported(number))
            object.__setattr__(self, "linear", linear)
            object.__setattr__(self, "shape", tuple(_cycles(number) for number in numbers))
            object.__setattr__(self, "reported", reported)
        # Last, because it scales the parameters of all lines to the machine.
        super().__post_init__()

    @reaction
    def reaction(at, state, values, geometry, joint, out):
        """Add A sin(n q) + B cos(n q) of each line at the joint."""
        # Sine and cosine of every line come first, then the cycles of every line.
        lines = len(values) // 3
        for i in range(lines):
            # Columns have one amplitude at a time, and sines are slow.
            if values[2 * i] != 0.0 or values[2 * i + 1] != 0.0:
                angle = values[2 * lines + i] * at.q[joint]
                out[joint] += values[2 * i] * sin(angle) + values[2 * i + 1] * cos(angle)

    def with_parts(self, number: int) -> "Cogging":
        """Return the effect with a number of lines."""
        return replace(self, lines=number)

    def with_parts_named(self, names: Collection[str]) -> "Cogging":
        """Return the effect with as many lines as the names of its values require."""
        numbers = range(2, self.most_parts + 1)
        present = [k for k in numbers if {p.name for p in _reported(f"_{k}")} & set(names)]
        return self.with_parts(max(present, default=1))

    def physical(self, values: NDArray) -> NDArray:
        """Return amplitude, cycles per turn and phase of sin(n q + phase) of each line.

        Parameters
        ----------
        values : (3 lines,) array
            Amplitudes of sine and cosine of each line, N·m, then the cycles per turn.

        Returns
        -------
        (3 lines,) array
            N·m, 1 and rad, line after line.
        """
        values = np.asarray(values, dtype=float)
        sine, cosine = values[: 2 * self.lines].reshape(-1, 2).T
        cycles = values[2 * self.lines :]
        return np.column_stack([np.hypot(sine, cosine), cycles, np.arctan2(cosine, sine)]).ravel()

    def values_from(self, physical: NDArray) -> NDArray:
        """Return the amplitudes of sine and cosine of each line, then the cycles per turn.

        Parameters
        ----------
        physical : (3 lines,) array
            Amplitude, N·m, cycles per turn and phase, rad, line after line.

        Returns
        -------
        (3 lines,) array
            N·m, and the cycles.
        """
        amplitude, cycles, phase = np.reshape(physical, (-1, 3)).T
        waves = np.column_stack([amplitude * np.cos(phase), amplitude * np.sin(phase)])
        return np.concatenate([waves.ravel(), cycles])
