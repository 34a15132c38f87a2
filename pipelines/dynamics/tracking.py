"""The leg under the adaptive controller: one run along a reference."""

from dataclasses import dataclass

import numpy as np
import pandas as pd
from numpy.typing import NDArray

from pipelines.contracts import Joint
from pipelines.contracts.joints import columns_of, in_words
from pipelines.dynamics.mobility import substeps_for
from pipelines.dynamics.plant import Plant
from pipelines.dynamics.rbf_loop import TURN, Encoder, RbfController, RbfRun, follow_with_rbf
from pipelines.errors import InputError
from pipelines.mechanics.trajectory import Trajectory
from pipelines.settings.simulate import SimulateSettings


@dataclass(frozen=True)
class ClosedLoop:
    """A simulated closed loop at n samples of J joints."""

    time: NDArray
    """(n,) s."""
    reference: NDArray
    """(n, J) rad."""
    run: RbfRun
    joints: tuple[Joint, ...]
    requested: int
    """Number of samples requested; n is smaller if a joint ran away."""

    @property
    def error(self) -> NDArray:
        """Reference less angle, (n, J) rad."""
        return self.reference - self.run.angle

    def worst_error(self, after_s: float) -> NDArray:
        """Return the largest error of each joint after a time.

        Parameters
        ----------
        after_s : float
            Samples before are left out, s.

        Returns
        -------
        (J,) array
            rad; NaN if a joint ran away.
        """
        if self.ran_away:
            return np.full(len(self.joints), np.nan)
        # Before that time the leg is still on its way from rest to the reference.
        return np.abs(self.error[self.time >= after_s]).max(axis=0)

    @property
    def ran_away(self) -> str:
        """The joint that ran away, and when, in words; empty if none did."""
        if len(self.time) == self.requested:
            return ""
        # The first joint whose last angle is not within a turn; NaN is not, either.
        joint = self.joints[int(np.argmin(np.abs(self.run.angle[-1]) < TURN))]
        bound = "one full turn" if joint.kind == "revolute" else f"{TURN:.3g} m"
        return f"the simulated {joint.name} ran past {bound} at t = {self.time[-1]:.3f} s"

    def frame(self) -> pd.DataFrame:
        """Return the columns of a ``simulation/1`` table.

        Returns
        -------
        DataFrame
            n rows; rad, rad/s and N·m.
        """
        quantities = {
            "reference": self.reference,
            "angle": self.run.angle,
            "velocity": self.run.speed,
            "error": self.error,
            "torque": self.run.torque,
            "network": self.run.network,
        }
        return pd.DataFrame({"time_s": self.time} | columns_of(self.joints, quantities))


def track(
    plant: Plant,
    settings: SimulateSettings,
    reference: Trajectory,
    feedback_gain: float | None = None,
) -> ClosedLoop:
    """Simulate the leg along a reference, from rest, hanging straight down.

    Parameters
    ----------
    plant : Plant
        Model to be simulated.
    settings : SimulateSettings
        Controller, encoder and duration.
    reference : Trajectory
        Angles to be followed.
    feedback_gain : float, optional
        Kv in N·m·s/rad; by default that of the settings.
    """
    _refuse_other_joints(reference, plant)
    _refuse_short(reference, settings)
    if feedback_gain is None:
        feedback_gain = settings.feedback_gain_nm_s_rad
    period, joints = settings.step_s, len(plant.joints)
    substeps = substeps_for(plant.assembly, feedback_gain, period)
    n = round(settings.duration_s / period) + 1
    # A Runge-Kutta step reads its inputs at start, middle and end.
    half_steps = np.arange(2 * (n - 1) * substeps + 1) * (0.5 * period / substeps)
    disturbance = settings.disturbance_nm * np.sin(settings.disturbance_rad_s * half_steps)
    wanted = np.stack(reference.at(half_steps), axis=1)
    controller, encoder = _controller(settings, feedback_gain), _encoder(settings, n, joints)
    push, start = np.repeat(disturbance[:, np.newaxis], joints, axis=1), np.zeros(joints)
    loop = (plant.assembly, controller, encoder)
    run = follow_with_rbf(*loop, wanted, push, period, start, substeps)
    reached = len(run.angle)
    return ClosedLoop(
        np.arange(reached) * period, wanted[:: 2 * substeps, 0][:reached], run, plant.joints, n
    )


def _controller(settings: SimulateSettings, feedback_gain: float) -> RbfController:
    # The network's centres lie between plus and minus this value, on the diagonal.
    nodes_reach = 1.5
    return RbfController(
        error_gain=settings.error_gain_1_s,
        feedback_gain=feedback_gain,
        adaptation_gain=settings.adaptation_gain,
        robust_gain=settings.robust_gain_nm,
        limit=settings.torque_limit_nm,
        nodes=np.linspace(-nodes_reach, nodes_reach, settings.network_nodes),
        width=settings.network_width,
    )


def _encoder(settings: SimulateSettings, samples: int, joints: int) -> Encoder:
    counts, noise = settings.encoder_counts_per_turn, settings.encoder_noise_rad
    ideal = counts == 0 and noise == 0
    draw = np.random.default_rng(settings.seed)
    return Encoder(
        noise=np.zeros((0, joints)) if ideal else noise * draw.standard_normal((samples, joints)),
        rad_per_count=2.0 * np.pi / counts if counts else 0.0,
        # A first-order low-pass of the differences, as in the drives' loop.
        speed_share=float(1.0 - np.exp(-2.0 * np.pi * settings.speed_cutoff_hz * settings.step_s)),
    )


def _refuse_other_joints(reference: Trajectory, plant: Plant) -> None:
    if reference.joints != plant.joints:
        raise InputError(
            f"the reference moves {in_words(reference.joints)}, expected the model's joints,"
            f" {in_words(plant.joints)}; give a reference for these"
        )


def _refuse_short(reference: Trajectory, settings: SimulateSettings) -> None:
    # A sampled motion ends at its last sample, so half a step is allowed for rounding.
    if reference.duration_s < settings.duration_s - 0.5 * settings.step_s:
        raise InputError(
            f"the reference lasts {reference.duration_s:g} s, but simulate.duration_s asks for"
            f" {settings.duration_s:g} s; shorten that, or give a reference that repeats"
            " (omega_rad_s)"
        )
