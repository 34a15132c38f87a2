"""The simulated machine of the virtual rig: a leg, its drives' position loops, and its sensors."""

from collections.abc import Iterable
from dataclasses import dataclass

import numpy as np
from numba import njit
from numpy.typing import NDArray

from pipelines.dynamics.assembly import Assembly, assemble, in_order
from pipelines.dynamics.forward import DQ, Q, stages, workspace
from pipelines.dynamics.pd_loop import advance, loop_at_rest, make_drives
from pipelines.effects.baseline import Friction, RigidBody
from pipelines.effects.kernel import Instant, reaction_at
from pipelines.errors import InputError, SettingsError
from pipelines.mechanics.geometry import Geometry
from pipelines.mechanics.mechanisms.leg import LEG
from pipelines.model import Model, Term, effect_named, term_from
from pipelines.rig.cuffs import cuff_forces
from pipelines.settings.rig.plant import PlantEffect, PlantSettings

JOINTS = ("hip", "knee")


@dataclass(frozen=True)
class Samples:
    """Measurements of the rig's devices at n instants, SI units."""

    time: NDArray
    """(n,) s, the middle of each sample's window."""
    sequence: NDArray
    """(n,) sample counter."""
    angle: NDArray
    """(n, J) rad, latched at the middle of the window."""
    velocity: NDArray
    """(n, J) rad/s, the drives' own estimate."""
    torque: NDArray
    """(n, J) N·m, mean over the window."""
    temperature: NDArray
    """(n, J) °C."""
    reference: NDArray
    """(n, J) rad, set-point at the window's end."""
    forces: NDArray
    """(n, 4, 3) N; in an empty machine the sensors' zeros and noise alone."""
    truth: NDArray
    """(n, 4, J) true link angle, speed, acceleration and motor angle, for tests."""

    def __getitem__(self, places: slice) -> "Samples":
        return Samples(**{name: values[places] for name, values in vars(self).items()})


class Plant:
    """A leg in motion; each call of ``run`` continues from the last state."""

    def __init__(
        self,
        settings: PlantSettings,
        run: str,
        seed: int = 0,
        effects: Iterable[Term] = (),
        sample_rate_hz: float | None = None,
    ) -> None:
        """Build the leg at rest.

        Parameters
        ----------
        settings : PlantSettings
        run : str
            ``exo_alone`` or ``with_human``.
        seed : int
            Seed of this run's noise.
        effects : iterable of Term
            Effects in addition to those of the settings, such as hidden ones.
        sample_rate_hz : float, optional
            Samples a second; by default that of the settings.
        """
        self.settings = settings
        self.has_human = run == "with_human"
        self.sample_rate_hz = sample_rate_hz or settings.sample_rate_hz
        self.geometry = Geometry(
            settings.thigh_length_m,
            settings.gravity_m_s2,
            settings.thigh_cuff_distance_m if self.has_human else None,
            settings.shank_cuff_distance_m if self.has_human else None,
        )
        self.model = _model(settings, self.geometry, effects).for_run(run)
        self._assembly = assemble(self.model, self.geometry, JOINTS)
        self._of_human = np.array([term.effect.on_limb for term in in_order(self.model)])
        self._drives = make_drives(
            np.array(settings.kp_nm_rad),
            np.array(settings.kd_nm_s_rad),
            np.array(settings.limit_nm),
            np.array(settings.counts_per_turn),
            settings.drive_rate_hz,
            self.sample_rate_hz,
        )
        self._loop = loop_at_rest(self._assembly, np.array(settings.rest_rad))
        self._scratch = workspace(len(JOINTS)), stages(len(JOINTS), len(self._loop.memory))
        self._noise = np.random.default_rng(seed)
        # Separate, so that an empty machine's sensors do not change its drives' noise.
        self._sensor_noise = np.random.default_rng([seed, 1])
        self._ripple = np.zeros(len(JOINTS))
        warming = settings.temperature
        self._warming = (warming.ambient_c, warming.heating_c_nm2, warming.time_constant_s)
        self._assembly.temperature[:] = warming.ambient_c
        # By the rig's seed, not the run's: a sensor keeps its zero from run to run.
        self._zeros = np.random.default_rng(settings.seed).normal(0.0, settings.cuff.zero_n, (4, 3))
        self._samples = 0

    @property
    def reference(self) -> NDArray:
        """Last set-point, (J,) rad; at first the leg's angle."""
        return self._loop.reference.copy()

    def run(self, reference: NDArray, enabled: NDArray) -> Samples:
        """Move the leg along set-points and measure.

        Parameters
        ----------
        reference : (n, J) array
            Set-point at each sample's end, rad.
        enabled : (J,) array of bool
            Drives that follow their set-points; the others apply no torque.

        Returns
        -------
        Samples
            One for each set-point.
        """
        n = len(reference)
        period = 1.0 / self.sample_rate_hz
        reference = np.ascontiguousarray(reference, dtype=float)
        out = _run(
            self._assembly,
            self._drives,
            *self._scratch,
            self._loop,
            self._samples,
            period,
            reference,
            enabled,
            self._of_human,
            self._warming,
        )
        angle, velocity, torque, temperature, truth, human = out
        sequence = self._samples + np.arange(n)
        self._samples += n
        torque = torque + self._torque_error(n)
        return Samples(
            time=(sequence + 0.5) * period,
            sequence=sequence,
            angle=angle,
            velocity=velocity,
            torque=torque,
            temperature=temperature,
            reference=reference,
            forces=self._cuff_forces(human, truth) if self.has_human else self._noise_alone(n),
            truth=truth,
        )

    def _torque_error(self, n: int) -> NDArray:
        """Return coloured noise with the settings' rms and correlation time, (n, J) N·m."""
        settings = self.settings
        memory = 0.0
        if settings.ripple_correlation_s > 0:
            memory = np.exp(-1.0 / (self.sample_rate_hz * settings.ripple_correlation_s))
        white = self._noise.standard_normal((n, len(JOINTS))) * settings.ripple_nm
        # First-order autoregressive noise, x = m x' + sqrt(1 - m²) w. Once settled, its rms is that
        # of w for every m.
        return _first_order(
            np.sqrt(1.0 - memory**2) / (1.0 - memory) * white, 1.0 - memory, self._ripple
        )

    def _cuff_forces(self, human_torque: NDArray, truth: NDArray) -> NDArray:
        forces = cuff_forces(human_torque, truth[:, Q], self.settings)
        return (
            forces + self._zeros + self._noise.normal(0.0, self.settings.cuff.noise_n, forces.shape)
        )

    def _noise_alone(self, n: int) -> NDArray:
        return self._zeros + self._sensor_noise.normal(0.0, self.settings.cuff.noise_n, (n, 4, 3))


def term_of(effect: PlantEffect, source: str) -> Term:
    """Return a setting as a term of the model; errors begin with ``source``.

    Raises
    ------
    SettingsError
        The effect has no such joint or values.
    """
    try:
        built = effect_named(effect.effect)(joint=effect.joint)
        if (effect.joint is None) != built.whole_leg:
            wanted = "no joint: it acts on the whole leg" if built.whole_leg else "a joint"
            raise SettingsError(f"{built.name} has joint {effect.joint}, expected {wanted}")
        return term_from(built, effect.values)
    except InputError as error:
        raise SettingsError(f"{source}: {error}") from None


def _model(settings: PlantSettings, geometry: Geometry, effects: Iterable[Term]) -> Model:
    """Return the model of the machine, with the person as a rigid body of their own."""
    # X1 to X4 are sums over bodies, so those of exoskeleton and wearer add up. Both sums must be
    # possible.
    exo, human = np.array(settings.exo_inertial), np.array(settings.human_inertial)
    for name, X in (("exo_inertial", exo), ("exo_inertial + human_inertial", exo + human)):
        broken = LEG.unrealizable(X, geometry)
        if broken:
            raise SettingsError(f"plant.{name}: no real leg has these: {broken[0]}; correct them")
    frictions = zip(JOINTS, settings.coulomb_nm, settings.viscous_nm_s_rad, strict=True)
    return Model(
        (
            Term(RigidBody(), exo),
            Term(RigidBody(run="with_human"), human),
            *(
                Term(Friction(joint), np.array([coulomb, viscous]))
                for joint, coulomb, viscous in frictions
            ),
            *(term_of(effect, f"plant.effects[{i}]") for i, effect in enumerate(settings.effects)),
            *effects,
        )
    )


@njit(cache=True)
def _first_order(wanted, share, state):
    """Low-pass ``wanted`` (n, J) by a first-order filter of gain ``share`` and ``state`` (J,)."""
    out = np.empty_like(wanted)
    for k in range(len(wanted)):
        for j in range(len(state)):
            state[j] += share * (wanted[k, j] - state[j])
            out[k, j] = state[j]
    return out


@njit(cache=True)
def _run(a: Assembly, d, w, s, loop, first, period, reference, enabled, of_human, warming):
    """Simulate the position loops along set-points (n, J).

    ``warming`` is the room's temperature (°C), the final rise per squared torque (°C/(N·m)²), and
    the rise's time constant (s).

    Returns measured angle, speed and torque (n, J), the motors' temperature (n, J), truth (n, 4,
    J), and the torque of the terms marked in ``of_human`` (n, J).
    """
    ambient, heating, time_constant = warming
    n, joints = reference.shape
    angle, speed, torque = np.empty((n, joints)), np.empty((n, joints)), np.empty((n, joints))
    truth, human = np.empty((n, 4, joints)), np.zeros((n, joints))
    temperature = np.empty((n, joints))
    direction = np.empty(joints)
    for k in range(n):
        t = (first + k) * period
        advance(a, d, w, s, loop, t, reference[k], enabled, angle[k], speed[k], torque[k], truth[k])
        for j in range(joints):
            temperature[k, j] = a.temperature[j]
            # Copper losses grow with the square of the current, and so of the torque. One Euler
            # step is enough: the period is far shorter than the time constant.
            final = ambient + heating * torque[k, j] ** 2
            a.temperature[j] += period / time_constant * (final - a.temperature[j])
            direction[j] = np.sign(truth[k, DQ, j])
        at = Instant(
            t + 0.5 * period,
            truth[k, Q],
            truth[k, DQ],
            truth[k, 2],
            direction,
            loop.load,
            temperature[k],
        )
        # The torque that the limb takes in the middle of the window is what the cuffs transmit.
        for i in range(a.bounds[4]):
            if of_human[i]:
                values = a.values[a.value_at[i] : a.value_at[i + 1]]
                state = loop.memory[a.state_at[i] : a.state_at[i + 1]]
                reaction_at(a.reactions[i])(at, state, values, a.geometry, a.joint[i], human[k])
    return angle, speed, torque, temperature, truth, human
