"""Simulate the runs of a planned trajectory on a faultless leg, with their noise."""

import numpy as np

from pipelines.diagnosis.evidence.noise_floor import Floor
from pipelines.effects.baseline import Friction
from pipelines.mechanics.geometry import Geometry
from pipelines.mechanics.mechanisms.leg import LEG
from pipelines.mechanics.motion import Motion
from pipelines.mechanics.trajectory import Trajectory
from pipelines.settings.design import NoiseSettings
from pipelines.settings.mechanism import MechanismSettings
from pipelines.settings.rig.plant import PlantSettings
from pipelines.signals.blocks import BlockAverage


def usual_plant(mechanism: MechanismSettings) -> PlantSettings:
    """Return the virtual rig's leg with the lengths of an experiment."""
    return PlantSettings(**mechanism.geometry)


def planned_motions(
    trajectory: Trajectory,
    plant: PlantSettings,
    noise: NoiseSettings,
    kinds: tuple[str, ...],
    rate_hz: float,
) -> list[Motion]:
    """Return one motion of each kind of run, without cuff forces.

    Its torque is that of rigid body and friction.

    Parameters
    ----------
    trajectory : Trajectory
        Of hip and knee.
    plant : PlantSettings
        Parameters of the leg and the wearer.
    noise : NoiseSettings
        Its ``duration_s`` limits the motion.
    kinds : tuple of str
        ``exo_alone``, ``with_human``.
    rate_hz : float
        Sample rate, Hz.
    """
    count = round(min(noise.duration_s, trajectory.duration_s) * rate_hz)
    time = np.arange(count) / rate_hz
    q, dq, ddq = trajectory.at(time)
    geometry = Geometry(thigh_length_m=plant.thigh_length_m, gravity_m_s2=plant.gravity_m_s2)
    Y = LEG.regressor(q, dq, ddq, geometry)
    names = tuple(joint.name for joint in trajectory.joints)
    motions = []
    for kind in kinds:
        worn = np.array(plant.human_inertial) if kind == "with_human" else 0.0
        load = Y @ (np.array(plant.exo_inertial) + worn)
        motion = Motion(
            time,
            q,
            dq,
            ddq,
            # A copy, because friction is added to the drives' torque and not to the load behind.
            torque=load.copy(),
            load=load,
            segment=np.zeros(count, np.int64),
            valid=np.ones(count, bool),
            run=kind,
            sample_rate_hz=rate_hz,
            period_s=trajectory.period_s,
            joints=names,
            geometry=geometry,
            file=kind,
            metadata={"joints": [joint.metadata for joint in trajectory.joints]},
        )
        levels = zip(plant.coulomb_nm, plant.viscous_nm_s_rad, strict=True)
        for joint, own in zip(names, levels, strict=True):
            motion.torque[:] += Friction(joint).torque(motion, np.array(own))
        motions.append(motion)
    return motions


def planned_noise(noise: NoiseSettings, rate_hz: float, block: BlockAverage) -> Floor:
    """Return the noise of two drives behind the regression filter; cuffs are not planned.

    For noise with correlation exp(-t / T) a mean of D samples has the variance s² (1 + 2 sum (1 -
    i/D) rho^i) / D, and its integral over all lags is that of the noise itself.

    Parameters
    ----------
    noise : NoiseSettings
        rms, N·m, and correlation time, s.
    rate_hz : float
        Sample rate, Hz.
    block : BlockAverage
        The regression filter.

    Returns
    -------
    Floor
        rms (4,), N·m, NaN for cuffs, and independent shares (4,).
    """
    rho = np.exp(-1.0 / (rate_hz * noise.correlation_s)) if noise.correlation_s > 0 else 0.0
    D = block.decimation
    lags = np.arange(1, D)
    variance = (1.0 + 2.0 * np.sum((1.0 - lags / D) * rho**lags)) / D
    # An average keeps the integral of the noise over
    # all lags, so this and the variance give the share.
    integral = (1.0 + rho) / (1.0 - rho) / D
    rms = np.array([noise.hip_nm, noise.knee_nm]) * np.sqrt(variance)
    return Floor(
        np.append(rms, [np.nan, np.nan]), np.full(4, variance / integral), from_periods=False
    )
