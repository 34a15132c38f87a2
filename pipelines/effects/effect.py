"""The interface of an effect: one physical phenomenon, its equation stated once.

An effect says where it acts by which hooks it has:

===============  ==============================================================
``reaction``     torque the drives must supply; linear in ``linear``, any function of ``shape``
``derivative``   rate of the memory (``states`` of it) that ``reaction`` reads
``spring``       torque between motor and link where a joint is not rigid
``reading``      what a sensor makes of the truth
``corrected``    the inverse of ``spring`` or ``reading`` for a measured motion
===============  ==============================================================

Identification and diagnosis use ``columns`` and ``corrected``; the forward dynamics uses the
compiled hooks. ``columns`` evaluates the same kernels, so the two cannot disagree.
"""

from abc import ABC
from collections.abc import Callable
from dataclasses import dataclass
from enum import StrEnum
from typing import Any, ClassVar

import numpy as np
from numpy.typing import NDArray

from pipelines.effects.kernel import torque_along, torque_along_with_memory
from pipelines.mechanics.motion import Motion

RUNS = ("exo_alone", "with_human")


class Side(StrEnum):
    """Where an effect acts."""

    DRIVE = "drive"
    STRUCTURE = "structure"
    SENSOR = "sensor"
    HUMAN = "human"


@dataclass(frozen=True)
class Parameter:
    """One number of an effect."""

    name: str
    unit: str
    meaning: str
    symbol: str
    typical: tuple[float, float]
    """The range seen on exoskeletons; a search for a shape parameter spans it."""
    per_run: bool = False
    """True where each run has a value of its own, as an onset time has."""


@dataclass(frozen=True)
class Effect(ABC):
    """A physical effect, bound to a joint (and, if asked, to one kind of run)."""

    joint: str | None = None
    """The joint it acts at; None for an effect of the whole leg."""
    run: str | None = None
    """The only kind of run whose torque it explains; None for all it acts in."""

    name: ClassVar[str]
    title: ClassVar[str]
    side: ClassVar[Side]
    equation: ClassVar[str]
    source: ClassVar[str]
    looks_like: ClassVar[str]
    """What it leaves in a plot of the residual."""
    confirm: ClassVar[str]
    """How to make sure of it on the rig."""
    joints: ClassVar[tuple[str, ...] | None] = None
    """The only joints that can have it; None for any."""
    whole_leg: ClassVar[bool] = False
    acts_in: ClassVar[tuple[str, ...]] = RUNS
    linear: ClassVar[tuple[Parameter, ...]] = ()
    shape: ClassVar[tuple[Parameter, ...]] = ()

    states: ClassVar[int] = 0
    inertial: ClassVar[bool] = False
    """True where ``reaction`` depends on acceleration: it then adds to the mass matrix."""
    motor_inertia: ClassVar[float] = 0.0
    """kg·m² on the motor's side of ``spring``."""
    reaction: ClassVar[Callable[..., Any] | None] = None
    derivative: ClassVar[Callable[..., Any] | None] = None
    spring: ClassVar[Callable[..., Any] | None] = None
    reading: ClassVar[Callable[..., Any] | None] = None

    @property
    def parameters(self) -> tuple[Parameter, ...]:
        """Linear parameters, then shape parameters: the order of ``values`` everywhere."""
        return self.linear + self.shape

    @property
    def label(self) -> str:
        """``effect@joint``, as tables of candidates name it."""
        return f"{self.name}@{self.joint}" if self.joint else self.name

    def explains(self, motion: Motion) -> bool:
        """Tell whether the effect is there in this kind of run."""
        return motion.run in self.acts_in and self.run in (None, motion.run)

    def columns(self, motion: Motion, shape: NDArray | tuple[float, ...] = ()) -> NDArray:
        """Torque per unit of each linear parameter, (n, J, p) N·m per unit.

        ``shape`` holds the nonlinear parameters, in the order of ``self.shape``.
        """
        columns = np.zeros((*motion.q.shape, len(self.linear)))
        if self.reaction is None or not self.explains(motion):
            return columns
        for i in range(len(self.linear)):
            unit = np.zeros(len(self.linear))
            unit[i] = 1.0
            columns[:, :, i] = self.torque(motion, np.append(unit, shape))
        return columns

    def torque(self, motion: Motion, values: NDArray) -> NDArray:
        """Torque the drives must supply for this effect, (n, J) N·m."""
        if self.reaction is None or not self.explains(motion):
            return np.zeros(motion.q.shape)
        joint = motion.joint_index(self.joint) if self.joint else -1
        values = np.ascontiguousarray(values, dtype=float)
        geometry = motion.geometry.array()
        of_motion = (motion.time, motion.q, motion.dq, motion.ddq, motion.transmitted[0])
        arrays = [np.ascontiguousarray(array) for array in of_motion]
        if self.derivative is None:
            return torque_along(self.reaction, values, joint, *arrays, geometry)
        out = np.empty(motion.q.shape)
        for stretch in motion.segments():
            out[stretch] = torque_along_with_memory(
                self.reaction, self.derivative, self.states, values, joint, *(a[stretch] for a in arrays), geometry
            )
        return out

    def corrected(self, motion: Motion, shape: NDArray | tuple[float, ...]) -> Motion:
        """Return the motion as it would have been measured without this effect in the sensor or transmission."""
        return motion
