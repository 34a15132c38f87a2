"""An encoder that does not turn about the joint's own axis."""

from collections.abc import Sequence
from math import cos, sin
from typing import ClassVar

import numpy as np
from numpy.typing import NDArray

from pipelines.effects.effect import Effect, Family, Parameter, Side, Tie
from pipelines.effects.kernel import reading
from pipelines.mechanics.machine import Machine
from pipelines.mechanics.motion import Motion


class EncoderEccentricity(Effect):
    """The measured angle errs once per turn, and twice if tracks or windings are unequal.

    Over less than half a turn, the errors resemble an encoder's offset and a scale of the angle.
    """

    name = "encoder_eccentricity"
    title = "Encoder eccentricity"
    side = Side.SENSOR
    family = Family.SENSOR
    resembles = ("angle", "other_angle", "both_angles", "inertia_by_angle", "friction_by_angle")
    forms_differ = "a real scale also errs at higher multiples of a turn, and at its splice"
    equation = "measured angle = q + a sin(q + phi) + b sin(2 q + psi), q the true angle"
    source = "Lu, Graetz, Amin-Shahidi, Smeds (2010), CIRP Annals 59(1): self-calibrated encoders"
    looks_like = "gravity and inertia torques off by a share that changes with the joint's angle"
    confirm = "turn the joint to marks of known angle all the way round, and read the encoder"
    ties: ClassVar = {
        "encoder_offset": Tie(
            "over less than half a turn an error once a turn is nearly a constant and a scale of"
            " the angle",
            "turn the joint to marks of known angle all the way round, and read the encoder",
        ),
    }
    shape = (
        Parameter("sine", "rad", "amplitude of sin(q)", "A1", (-0.06, 0.06)),
        Parameter("cosine", "rad", "amplitude of cos(q)", "B1", (-0.06, 0.06)),
        Parameter("sine_twice", "rad", "amplitude of sin(2 q)", "A2", (-0.03, 0.03), default=0.0),
        Parameter("cosine_twice", "rad", "amplitude of cos(2 q)", "B2", (-0.03, 0.03), default=0.0),
    )
    reported = (
        Parameter("amplitude", "rad", "amplitude of the error once per turn", "a", (0.005, 0.06)),
        Parameter("phase", "rad", "phase of that error at angle zero", "phi", (-np.pi, np.pi)),
        Parameter(
            "amplitude_twice",
            "rad",
            "amplitude of the error twice per turn",
            "b",
            (0.0, 0.03),
            default=0.0,
        ),
        Parameter(
            "phase_twice",
            "rad",
            "phase of that error at angle zero",
            "psi",
            (-np.pi, np.pi),
            default=0.0,
        ),
    )

    @classmethod
    def possible(cls, machine: Machine) -> list[str | None]:
        """Return the revolute joints."""
        joints = super().possible(machine)
        return [name for name in joints if name and machine.joint(name).kind == "revolute"]

    @reading
    def reading(angle, values, joint):
        """Add A1 sin q + B1 cos q + A2 sin 2q + B2 cos 2q."""
        q = angle[joint]
        once = values[0] * sin(q) + values[1] * cos(q)
        angle[joint] = q + once + values[2] * sin(2.0 * q) + values[3] * cos(2.0 * q)

    def corrected(self, motion: Motion, shape: NDArray | tuple[float, ...]) -> Motion:
        """Return the motion with the true angle, speed and acceleration.

        Parameters
        ----------
        motion : Motion
            As measured, n samples.
        shape : (4,) array or tuple of float
            Amplitudes of sine and cosine once and twice per turn, rad.

        Returns
        -------
        Motion
            Of the motors, n samples.
        """
        values, j = self.completed(shape), self.column(motion)
        q, dq, ddq = motion.q.copy(), motion.dq.copy(), motion.ddq.copy()
        true = q[:, j].copy()
        # The error is a function of the true angle, and only the reading is known. Each of Newton's
        # steps squares the distance to it, which begins below 0.1 rad.
        for _ in range(8):
            error, slope, _ = _errors(true, values)
            true -= (true + error - q[:, j]) / (1.0 + slope)
        _, slope, curvature = _errors(true, values)
        q[:, j] = true
        # With q_m = q + e(q), dq_m = (1 + e') dq. Then ddq_m = (1 + e') ddq + e'' dq².
        dq[:, j] /= 1.0 + slope
        ddq[:, j] = (ddq[:, j] - curvature * dq[:, j] ** 2) / (1.0 + slope)
        return motion.with_state(q, dq, ddq)

    def directions(self, motions: Sequence[Motion]) -> tuple[tuple[tuple[float, ...], ...], ...]:
        """Return sine and cosine once per turn, and the same with those twice per turn."""
        # Small amplitudes, for which the correction is nearly linear.
        units = 0.01 * np.eye(4)
        every = tuple(tuple(unit.tolist()) for unit in units)
        return every[:2], every

    def physical(self, values: NDArray) -> NDArray:
        """Return amplitude and phase, once and twice per turn.

        Parameters
        ----------
        values : (4,) array
            Amplitudes of sine and cosine, once and twice per turn, rad.

        Returns
        -------
        (4,) array
            Amplitude, phase, amplitude, phase; rad.
        """
        sines, cosines = np.reshape(values, (2, 2)).T
        return np.column_stack([np.hypot(sines, cosines), np.arctan2(cosines, sines)]).ravel()

    def values_from(self, physical: NDArray) -> NDArray:
        """Return the amplitudes of sines and cosines.

        Parameters
        ----------
        physical : (4,) array
            Amplitude, phase, amplitude, phase; rad.

        Returns
        -------
        (4,) array
            Sine and cosine, once and twice per turn, rad.
        """
        amplitudes, phases = np.reshape(physical, (2, 2)).T
        return np.column_stack([amplitudes * np.cos(phases), amplitudes * np.sin(phases)]).ravel()

    def jacobian(self, values: NDArray) -> NDArray:
        """Return the derivatives of amplitudes and phases.

        Parameters
        ----------
        values : (4,) array
            Amplitudes of sine and cosine, rad.

        Returns
        -------
        (4, 4) array
            Zero for the phase of an amplitude of zero.
        """
        jacobian = np.zeros((4, 4))
        for k in (0, 2):
            sine, cosine = values[k : k + 2]
            amplitude = np.hypot(sine, cosine)
            if amplitude > 0.0:
                jacobian[k, k : k + 2] = sine / amplitude, cosine / amplitude
                jacobian[k + 1, k : k + 2] = -cosine / amplitude**2, sine / amplitude**2
        return jacobian


def _errors(q: NDArray, values: NDArray) -> tuple[NDArray, NDArray, NDArray]:
    """Return the encoder's error at true angles (n,), its slope and its curvature, (n,) each."""
    (s1, c1), (s2, c2) = ((np.sin(k * q), np.cos(k * q)) for k in (1, 2))
    a1, b1, a2, b2 = values
    error = a1 * s1 + b1 * c1 + a2 * s2 + b2 * c2
    slope = a1 * c1 - b1 * s1 + 2.0 * (a2 * c2 - b2 * s2)
    curvature = -a1 * s1 - b1 * c1 - 4.0 * (a2 * s2 + b2 * c2)
    return error, slope, curvature
