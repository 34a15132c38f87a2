"""Under which conditions a session is recorded: rates, lengths, sensors, and how good the rig is.

The shares below are those of every world; what is not drawn is a lab's usual choice.
"""

from dataclasses import dataclass

import numpy as np
from numpy.random import Generator

RATES_HZ = {100.0: 0.10, 250.0: 0.10, 500.0: 0.10, 200.0: 0.70}
"""Sample rates and the shares of sessions that have them."""
WITHOUT_PERIOD = 0.25
"""Share of sessions whose files do not say a period."""
APERIODIC = 0.5
"""Share of those whose motion has none."""
ONE_KIND = 0.20
"""Share of sessions with one kind of run, alone or with a person."""
WITHOUT_CUFFS = 0.25
"""Share of sessions with a person that have no force sensors."""
SHORT, SHORT_S = 0.15, (20.0, 40.0)
LONG, LONG_S = 0.10, (90.0, 120.0)
USUAL_S = (60.0, 70.0, 80.0)
"""Lengths of a run, and the shares of sessions with short and long ones."""
WITH_GAPS = 0.10
"""Share of sessions with a run in which the recorder lost samples, and said so."""
WITH_JITTER = 0.5
JITTER = (0.001, 0.02)
"""Share of sessions whose stamps stray, and by how much: rms, of a sample period."""
CLOCK_PPM = 50.0
"""Standard deviation of the error of the recorder's clock."""
WITH_TEMPERATURE = 0.25
"""Share of sessions that record the motors' temperatures though nothing depends on them."""
WITHOUT_REFERENCE, WITHOUT_SPEED, WITHOUT_COUNTER, WITHOUT_CONTROLLER = 0.15, 0.25, 0.2, 0.25
"""Shares of sessions without what a recording may have."""
IMPERFECTIONS, SMALLEST, LARGEST = (2, 5), 0.0002, 0.0025
"""How many small effects even a good rig has, and how large: rms over that of the joint's
torque."""


@dataclass(frozen=True)
class Conditions:
    """How one session is recorded."""

    rate_hz: float = 200.0
    duration_s: float = 70.0
    periodic: bool = True
    says_period: bool = True
    has_cuffs: bool = True
    gaps: int = 0
    """In one of its runs."""
    jitter: float = 0.0
    """RMS error of the stamps, of a sample period."""
    clock_ppm: float = 0.0
    has_temperature: bool = False
    has_reference: bool = True
    has_speed: bool = True
    has_counter: bool = True
    has_controller: bool = True

    @property
    def sample_s(self) -> float:
        """Time between samples."""
        return 1.0 / self.rate_hz

    @property
    def ticks(self) -> int:
        """Milliseconds between samples."""
        return round(1000.0 / self.rate_hz)


PLAIN = Conditions()


def random_conditions(rng: Generator) -> Conditions:
    """Draw how a session is recorded."""
    rates = list(RATES_HZ)
    says_period = rng.random() >= WITHOUT_PERIOD
    return Conditions(
        rate_hz=float(rng.choice(rates, p=[RATES_HZ[rate] for rate in rates])),
        duration_s=_duration(rng),
        periodic=bool(rng.random() >= APERIODIC) or says_period,
        says_period=says_period,
        has_cuffs=rng.random() >= WITHOUT_CUFFS,
        gaps=int(rng.integers(1, 4)) if rng.random() < WITH_GAPS else 0,
        jitter=_log_uniform(rng, *JITTER) if rng.random() < WITH_JITTER else 0.0,
        clock_ppm=float(rng.normal(0.0, CLOCK_PPM)),
        has_temperature=rng.random() < WITH_TEMPERATURE,
        has_reference=rng.random() >= WITHOUT_REFERENCE,
        has_speed=rng.random() >= WITHOUT_SPEED,
        has_counter=rng.random() >= WITHOUT_COUNTER,
        has_controller=rng.random() >= WITHOUT_CONTROLLER,
    )


def _duration(rng: Generator) -> float:
    draw = rng.random()
    if draw < SHORT:
        return float(np.round(rng.uniform(*SHORT_S)))
    if draw < SHORT + LONG:
        return float(np.round(rng.uniform(*LONG_S)))
    return float(rng.choice(USUAL_S))


def _log_uniform(rng: Generator, low: float, high: float) -> float:
    return float(np.exp(rng.uniform(np.log(low), np.log(high))))
