"""A wearer who pushes."""

from dataclasses import replace
from math import cos, pi, sin

import numpy as np
from numpy.typing import NDArray

from pipelines.effects.effect import Effect, Family, Parameter, Parity, Side
from pipelines.effects.kernel import reaction


class VoluntaryTorque(Effect):
    """The wearer helps or resists at a rhythm of their own, independent of the machine's."""

    name = "voluntary_torque"
    title = "Voluntary torque"
    side = Side.HUMAN
    family = Family.PERSON
    resembles = ("time", "hum", "bursts")
    forms_differ = "a real rhythm drifts in frequency and size, and starts and stops"
    equation = "tau = A sin(2 pi f t) + B cos(2 pi f t) + c"
    source = "Hogan, Sternad (2007), Experimental Brain Research 181: rhythmic movement"
    looks_like = (
        "a tone in residual and cuff forces, at a frequency that is no harmonic of the motion"
    )
    confirm = (
        "ask the wearer to relax, or put electrodes on the muscle; the empty machine must not"
        " show it"
    )
    cuff_coherence = (
        "cycle-to-cycle differences appear in cuff forces and drive torque alike, so they come from"
        " the wearer"
    )
    acts_in = ("with_human",)
    # Sine and cosine are linear, amplitude and phase are not.
    linear = (
        Parameter("sine", "N·m", "amplitude of the sine", "A", (-10.0, 10.0), per_run=True),
        Parameter("cosine", "N·m", "amplitude of the cosine", "B", (-10.0, 10.0), per_run=True),
        Parameter(
            "bias",
            "N·m",
            "mean torque, if the wearer pushes more in one direction",
            "c",
            (-5.0, 5.0),
            True,
        ),
    )
    shape = (Parameter("frequency", "Hz", "frequency of the rhythm", "f", (0.1, 3.0)),)
    reported = (
        Parameter("amplitude", "N·m", "half of peak to peak", "A", (0.5, 10.0)),
        *shape,
        Parameter(
            "phase",
            "rad",
            "phase of the rhythm when the run begins",
            "phi",
            (-np.pi, np.pi),
            True,
            0.0,
            of_joint=False,
        ),
        replace(linear[2], default=0.0),
    )
    parity = Parity.EVEN

    @reaction
    def reaction(at, state, values, geometry, joint, out):
        """Add A sin(2 pi f t) + B cos(2 pi f t) + c at the joint."""
        angle = 2.0 * pi * values[3] * at.t
        out[joint] += values[0] * sin(angle) + values[1] * cos(angle) + values[2]

    def physical(self, values: NDArray) -> NDArray:
        """Return amplitude, frequency and phase of the rhythm's sine, and the bias, (4,)."""
        sine, cosine, bias, frequency = values
        # With A sin x + B cos x = a sin(x + phi), tan(phi) = B / A.
        return np.array([np.hypot(sine, cosine), frequency, np.arctan2(cosine, sine), bias])

    def values_from(self, physical: NDArray) -> NDArray:
        """Return the amplitudes of sine and cosine, the bias, and the frequency, (4,)."""
        amplitude, frequency, phase, bias = physical
        return np.array([amplitude * np.cos(phase), amplitude * np.sin(phase), bias, frequency])
