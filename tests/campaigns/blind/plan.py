"""What is hidden in one run: every place where an effect can act, gathered before the run is
simulated."""

from dataclasses import dataclass, replace

import numpy as np
from numpy.random import Generator
from numpy.typing import NDArray

from tests.campaigns.blind.body import Leg, Payload, Segment
from tests.campaigns.blind.channel import Channel
from tests.campaigns.blind.encoders import WAVES
from tests.campaigns.blind.loop import Hidden
from tests.campaigns.blind.smooth import MEMORIES
from tests.campaigns.blind.transmissions import RIGID

HIP, KNEE = 0, 1
JOINTS = ("hip", "knee")


@dataclass(frozen=True)
class Run:
    """One run to be recorded; ``rng`` is that of what differs from run to run."""

    kind: str
    purpose: str
    duration_s: float
    rng: Generator
    temperature: NDArray | None = None
    """Of both motors at 50 Hz, (n, 2) degrees Celsius."""
    temperature_range: NDArray | None = None
    """Coldest and warmest that they are in any run of the session, (2, 2)."""

    @property
    def has_human(self) -> bool:
        """Is a person in the machine?"""
        return self.kind == "with_human"


class Plan:
    """Everything hidden in one run."""

    def __init__(self) -> None:
        self.rows: list[tuple] = []
        self.channel = Channel()
        self.added_mass = np.zeros((2, 2))
        self.transmission = np.full(2, RIGID)
        self.spring = np.zeros((2, 5))
        self.encoder_offset = np.zeros(2)
        self.wobble = np.zeros((2, 2 * WAVES))
        """Of the encoders: amplitude and phase of errors once, twice and three times a turn."""
        self.tilt = np.zeros(3)
        self.lumps: list[tuple[int, Segment]] = []
        self.payload: Payload | None = None
        self.load = np.array([0.0, 0.0, 1.0, 1.0])
        """Payload's mass, start, ramp, and whether it comes (+1) or goes (-1)."""
        self.cuffs: NDArray | None = None
        """(2, 6) of thigh and shank cuff, about their joints; None where both legs move as one.

        Stiffness (N·m/rad), damping (N·m·s/rad), hardening (1/rad²), slack (rad), share that
        relaxes, and its time (s).
        """

    def with_lumps(self, leg: Leg) -> Leg:
        """Return a leg with what is fixed to its segments."""
        for joint, lump in self.lumps:
            name = ("thigh", "shank")[joint]
            leg = replace(leg, **{name: getattr(leg, name) + lump})
        return leg

    def eccentric(self, joint: int, *waves: float) -> None:
        """Add errors to an encoder: amplitude and phase once a turn, twice, three times."""
        for c in range(0, len(waves), 2):
            size, angle = self.wobble[joint, c : c + 2]
            if not size:
                self.wobble[joint, c : c + 2] = waves[c : c + 2]
            elif waves[c]:
                both = size * np.exp(1j * angle) + waves[c] * np.exp(1j * waves[c + 1])
                self.wobble[joint, c : c + 2] = abs(both), np.angle(both)

    def torque(
        self, kind: int, joint: int, *p: float, human: bool = False, table: NDArray | None = None
    ) -> None:
        """Hide a torque at a joint."""
        self.rows.append((kind, joint, human, p, table))

    def soft(self, joint: int, kind: int, *spring: float) -> None:
        """Put a spring or a play between a motor and its link."""
        self.transmission[joint] = kind
        self.spring[joint, : len(spring)] = spring

    def hidden(self) -> Hidden:
        """Lay the hidden torques out for the compiled loop."""
        n = len(self.rows)
        longest = max([2, *(len(row[4]) for row in self.rows if row[4] is not None)])
        p, table = np.zeros((n, 8)), np.zeros((n, longest))
        for i, (_, _, _, values, curve) in enumerate(self.rows):
            p[i, : len(values)] = values
            if curve is not None:
                table[i] = np.concatenate([curve, np.full(longest - len(curve), curve[-1])])
        columns = [np.array([row[c] for row in self.rows], dtype=np.int64) for c in range(3)]
        return Hidden(*columns, p, np.zeros((n, MEMORIES)), table)
