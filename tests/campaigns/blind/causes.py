"""The catalogue's causes as a plant would have them: for each, several functional forms.

``FORMS[cause]`` lists functions that draw one form's shape and return a ``Cause``; ``own`` marks
the forms that the catalogue itself writes down, all others are what the literature offers beside
them. ``size`` is the one number by which a cause's magnitude is set.
"""

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np
from numpy.random import Generator
from numpy.typing import NDArray

from tests.campaigns.blind import dry, smooth
from tests.campaigns.blind.body import Payload, Segment
from tests.campaigns.blind.excitation import HIGHEST, LOWEST
from tests.campaigns.blind.families import OF_CATALOGUE
from tests.campaigns.blind.plan import HIP, JOINTS, KNEE, Plan, Run
from tests.campaigns.blind.transmissions import ELASTIC, PLAY, PLAY_HERTZ, WIND_UP
from tests.campaigns.blind.wandering import random_walk

Install = Callable[[Plan, float, Run], None]
Spec = tuple[str, int | None]
"""An effect and its joint; none for the whole leg."""
Reach = tuple[NDArray, NDArray]
"""Least and greatest angle of each joint that a motion comes to."""
BOUNDS: Reach = (LOWEST, HIGHEST)


@dataclass(frozen=True)
class Cause:
    """One effect with its shape drawn and its size open."""

    effect: str
    joint: int | None
    form: str
    own: bool
    """Is this form the catalogue's own?"""
    install: Install
    start: float
    """A size to begin the search for the wanted magnitude with."""
    largest: float = np.inf
    smallest: float = 0.0
    """Sizes between which the plant is a working leg that a lab would record."""
    parameters: Callable[[float], dict[str, float]] = lambda size: {}
    """Values of those parameters of the contract that this form has too."""
    shape: tuple[float, ...] = ()
    human: bool = False
    slow: bool = False
    """Does it change over a whole run?"""
    fast: bool = False
    """Is it too fast for block averages, and given sample by sample?"""
    follows_temperature: bool = False
    """Is it read off the recorded temperature?"""
    families: tuple[str, ...] = ()
    """Kinds of law that it may be said to be (``families.py``)."""
    repeats: bool = True
    """Is it the same in every period of the motion?"""
    at_both_joints: bool = False
    held_back: bool = False
    """Is it never shown to what learns from sessions?"""
    kin: tuple[str, ...] = ()
    """Causes of the contract that a person would call it by, where it is none of them."""

    @property
    def label(self) -> str:
        """``effect@joint``."""
        return self.effect if self.joint is None else f"{self.effect}@{JOINTS[self.joint]}"

    def acts_in(self, kind: str) -> bool:
        """Is it there in this kind of run?"""
        return kind == "with_human" or not self.human


Form = Callable[[Generator, int], Cause]
FORMS: dict[str, list[Form]] = {}


WORLDS = ("mujoco", "planar", "two_mass")


def form(
    effect: str,
    *,
    own: bool = False,
    worlds: tuple[str, ...] = WORLDS,
    plain: bool = True,
    warm: bool = False,
) -> Callable:
    """Register a form of a cause; the function's name is the form's.

    ``worlds`` are those whose plants have it, ``plain`` cases draw from the forms of the first
    examinations only, and ``warm`` forms need temperatures, which plain cases have not.
    """

    def register(draw: Callable) -> Callable:
        within = draw.__code__.co_argcount > 2

        def cause_of(rng: Generator, joint: int | None, reach: Reach = BOUNDS) -> Cause:
            drawn = draw(rng, joint, reach) if within else draw(rng, joint)
            kind = OF_CATALOGUE[effect]
            return Cause(
                effect=effect,
                form=draw.__name__,
                own=own,
                joint=joint,
                families=kind.families,
                repeats=kind.repeats,
                **drawn,
            )

        cause_of.own = own
        cause_of.form = draw.__name__
        cause_of.worlds = worlds
        cause_of.plain = plain
        cause_of.warm = warm
        FORMS.setdefault(effect, []).append(cause_of)
        return draw

    return register


def joints_of(effect: str) -> tuple[int | None, ...]:
    """Return the joints at which a cause can act."""
    return {"base_tilt": (None,), "rotor_inertia": (KNEE,)}.get(effect, (HIP, KNEE))


def log_uniform(rng: Generator, low: float, high: float) -> float:
    """Draw from the log-uniform distribution."""
    return float(np.exp(rng.uniform(np.log(low), np.log(high))))


def either(rng: Generator) -> float:
    """Draw +1 or -1."""
    return float(rng.choice([-1.0, 1.0]))


def hidden_torque(
    kind: int, joint: int, *shape: float, sign: float = 1.0, human: bool = False
) -> Install:
    """Return an installer of a torque whose first parameter is the size."""

    def install(plan: Plan, size: float, run: Run) -> None:
        if run.has_human or not human:
            plan.torque(kind, joint, sign * size, *shape, human=human)

    return install


# --- Dry and viscous friction


def _stribeck(kind, rng, joint):
    vs = rng.uniform(0.12, 0.45)
    return dict(
        install=hidden_torque(kind, joint, vs),
        start=3.0,
        shape=(vs,),
        parameters=lambda s: (
            {"stribeck_torque": s, "stribeck_velocity": vs} if kind == dry.STRIBECK_GAUSS else {}
        ),
    )


@form("stribeck_friction", own=True)
def gaussian(rng, joint):
    return _stribeck(dry.STRIBECK_GAUSS, rng, joint)


@form("stribeck_friction")
def lorentzian(rng, joint):
    return _stribeck(dry.STRIBECK_LORENTZ, rng, joint)


@form("stribeck_friction")
def exponential(rng, joint):
    return _stribeck(dry.STRIBECK_EXPONENTIAL, rng, joint)


@form("coulomb_asymmetry", own=True)
def by_direction(rng, joint):
    sign = either(rng)
    return dict(
        install=hidden_torque(dry.ASYMMETRY, joint, sign=sign),
        start=1.0,
        parameters=lambda s: {"asymmetry": sign * s},
    )


@form("coulomb_asymmetry")
def smooth_transition(rng, joint):
    width = rng.uniform(0.05, 0.2)
    return dict(
        install=hidden_torque(dry.ASYMMETRY_SMOOTH, joint, width, sign=either(rng)),
        start=1.0,
        shape=(width,),
    )


@form("viscous_asymmetry", own=True)
def by_speed(rng, joint):
    sign = either(rng)
    return dict(
        install=hidden_torque(smooth.VISCOUS_ASYMMETRY, joint, sign=sign),
        start=2.0,
        parameters=lambda s: {"asymmetry": sign * s},
    )


@form("viscous_asymmetry")
def rounded(rng, joint):
    width = rng.uniform(0.1, 0.3)
    return dict(
        install=hidden_torque(smooth.VISCOUS_ASYMMETRY_SMOOTH, joint, width, sign=either(rng)),
        start=2.0,
        shape=(width,),
    )


@form("load_dependent_friction", own=True)
def proportional(rng, joint):
    return dict(
        install=hidden_torque(dry.LOAD_LINEAR, joint),
        start=0.1,
        largest=0.45,
        parameters=lambda s: {"load_coefficient": s},
    )


@form("load_dependent_friction")
def root(rng, joint):
    scale = rng.uniform(10.0, 40.0)
    return dict(
        install=hidden_torque(dry.LOAD_ROOT, joint, scale), start=0.1, largest=0.45, shape=(scale,)
    )


@form("load_dependent_friction")
def above_a_preload(rng, joint):
    onset = rng.uniform(1.0, 5.0)
    return dict(
        install=hidden_torque(dry.LOAD_OFFSET, joint, onset), start=0.1, largest=0.5, shape=(onset,)
    )


@form("quadratic_drag", own=True)
def quadratic(rng, joint):
    return dict(
        install=hidden_torque(smooth.DRAG, joint, 2.0), start=2.0, parameters=lambda s: {"drag": s}
    )


@form("quadratic_drag")
def power(rng, joint):
    exponent = rng.uniform(1.7, 2.6)
    return dict(install=hidden_torque(smooth.DRAG, joint, exponent), start=2.0, shape=(exponent,))


def _presliding(kind, rng, joint, *more):
    angle = log_uniform(rng, 0.015, 0.1)
    return dict(
        install=hidden_torque(kind, joint, angle, *more),
        start=1.5,
        shape=(angle, *more),
        parameters=lambda s: (
            {"friction_torque": s, "presliding_angle": angle} if kind == smooth.DAHL else {}
        ),
    )


@form("presliding_hysteresis", own=True)
def dahl(rng, joint):
    return _presliding(smooth.DAHL, rng, joint)


@form("presliding_hysteresis")
def lugre(rng, joint):
    return _presliding(smooth.LUGRE, rng, joint, rng.uniform(0.2, 1.0))


@form("presliding_hysteresis")
def bouc_wen(rng, joint):
    return _presliding(smooth.BOUC_WEN, rng, joint, rng.uniform(1.2, 3.0))


@form("presliding_hysteresis")
def maxwell_slip(rng, joint):
    return _presliding(smooth.MAXWELL_SLIP, rng, joint)


def _warm_up(coulomb_kind, viscous_kind, rng, joint):
    time, share = rng.uniform(12.0, 50.0), rng.uniform(0.0, 0.6)
    # Mean speed is about 0.6 rad/s: so much of the drop is Coulomb friction's.
    viscous = (1.0 - share) / 0.6

    def install(plan: Plan, size: float, run: Run) -> None:
        plan.torque(coulomb_kind, joint, size * share, time)
        plan.torque(viscous_kind, joint, size * viscous, time)

    own = coulomb_kind == dry.WARMUP_EXPONENTIAL
    return dict(
        install=install,
        start=2.0,
        slow=True,
        shape=(time, share),
        parameters=lambda s: (
            {"viscous_drop": s * viscous, "coulomb_drop": s * share, "time_constant": time}
            if own
            else {}
        ),
    )


@form("friction_warmup", own=True)
def exponential_decay(rng, joint):
    return _warm_up(dry.WARMUP_EXPONENTIAL, smooth.WARM_VISCOUS_EXPONENTIAL, rng, joint)


@form("friction_warmup")
def power_law(rng, joint):
    return _warm_up(dry.WARMUP_POWER, smooth.WARM_VISCOUS_POWER, rng, joint)


def _cogging(rng, joint, second):
    cycles, phase = float(rng.integers(8, 60)), rng.uniform(0.0, 2 * np.pi)
    return dict(
        install=hidden_torque(
            smooth.COGGING, joint, cycles, phase, second, rng.uniform(0.0, 2 * np.pi)
        ),
        start=1.0,
        shape=(cycles, phase, second),
        parameters=lambda s: {"amplitude": s, "cycles_per_turn": cycles},
    )


@form("cogging", own=True)
def one_harmonic(rng, joint):
    return _cogging(rng, joint, 0.0)


@form("cogging")
def with_second_harmonic(rng, joint):
    return _cogging(rng, joint, rng.uniform(0.25, 0.5))


# --- Drive trains


@form("rotor_inertia", own=True)
def reflected(rng, joint):
    def install(plan: Plan, size: float, run: Run) -> None:
        plan.added_mass[joint, joint] += size

    return dict(install=install, start=0.2, parameters=lambda s: {"inertia": s})


@form("rotor_inertia")
def carried_by_the_thigh(rng, joint):
    """A rotor on the thigh turns with it as well: kinetic energy is J/2 (dq2 + dq1/n)^2."""
    ratio = rng.uniform(20.0, 120.0)

    def install(plan: Plan, size: float, run: Run) -> None:
        plan.added_mass += size * np.array([[1 / ratio**2, 1 / ratio], [1 / ratio, 1.0]])

    return dict(install=install, start=0.2, shape=(ratio,), parameters=lambda s: {"inertia": s})


def play(kind, rng, joint):
    stiffness, damping = log_uniform(rng, 2500.0, 6000.0), rng.uniform(2.0, 6.0)

    def install(plan: Plan, size: float, run: Run) -> None:
        plan.soft(joint, kind, stiffness, damping, size)

    return dict(
        install=install,
        start=0.03,
        smallest=0.004,
        largest=0.2,
        shape=(stiffness, damping),
        parameters=lambda s: {"play": s} if kind == PLAY else {},
    )


@form("backlash")
def two_masses_with_stiff_contact(rng, joint):
    return play(PLAY, rng, joint)


@form("backlash")
def two_masses_with_hertzian_contact(rng, joint):
    return play(PLAY_HERTZ, rng, joint)


def elastic(kind, rng, joint, *more):
    def install(plan: Plan, size: float, run: Run) -> None:
        damping = 0.1 * np.sqrt(0.04 / size)
        plan.soft(joint, kind, 1.0 / size, damping, *more)

    return dict(
        install=install,
        start=1 / 800.0,
        smallest=1 / 4000.0,
        largest=1 / 90.0,
        shape=more,
        parameters=lambda s: {"stiffness": 1.0 / s} if not more else {},
    )


@form("joint_elasticity", own=True)
def two_masses(rng, joint):
    return elastic(ELASTIC, rng, joint)


@form("joint_elasticity")
def hardening(rng, joint):
    return elastic(ELASTIC, rng, joint, log_uniform(rng, 50.0, 800.0))


@form("joint_elasticity")
def soft_wind_up(rng, joint):
    return elastic(WIND_UP, rng, joint, rng.uniform(0.004, 0.02), rng.uniform(1.4, 2.2))


# --- Structure


def _spring(rng, joint, cubic, damping):
    rest = rng.uniform(LOWEST[joint], HIGHEST[joint])
    return dict(
        install=hidden_torque(smooth.SPRING, joint, rest, cubic, damping),
        start=5.0,
        shape=(rest, cubic, damping),
        parameters=lambda s: {"stiffness": s, "rest_angle": rest} if cubic == damping == 0 else {},
    )


@form("parallel_spring", own=True)
def linear(rng, joint):
    return _spring(rng, joint, 0.0, 0.0)


@form("parallel_spring")
def hardening_and_damped(rng, joint):
    return _spring(rng, joint, rng.uniform(0.2, 0.8), rng.uniform(0.0, 0.05))


@form("base_tilt", own=True)
def constant(rng, joint):
    sign = either(rng)

    def install(plan: Plan, size: float, run: Run) -> None:
        plan.tilt[0] += sign * size

    return dict(install=install, start=0.05, largest=0.35, parameters=lambda s: {"tilt": sign * s})


@form("base_tilt")
def swaying(rng, joint):
    sign, depth, frequency = either(rng), rng.uniform(0.05, 0.15), rng.uniform(0.01, 0.04)

    def install(plan: Plan, size: float, run: Run) -> None:
        plan.tilt += np.array([sign * size, depth * size, frequency])

    return dict(
        install=install,
        start=0.05,
        largest=0.35,
        shape=(depth, frequency),
        parameters=lambda s: {"tilt": sign * s},
    )


@form("mass_off_axis", own=True)
def point_mass(rng, joint):
    """A lump at the segment's middle, in front of or behind its axis."""
    sign, distance = either(rng), rng.uniform(0.1, 0.25)

    def install(plan: Plan, size: float, run: Run) -> None:
        plan.lumps.append((joint, Segment(size / distance, 0.15, 0.0, sign * distance)))

    return dict(
        install=install,
        start=0.2,
        shape=(distance,),
        parameters=lambda s: {"mass_moment": sign * s},
    )


@form("mass_off_axis")
def extended_body(rng, joint):
    """A housing or a foot: a body with an inertia of its own near the segment's end."""
    sign, distance = either(rng), rng.uniform(0.06, 0.15)
    along, gyration = rng.uniform(0.25, 0.38), rng.uniform(0.03, 0.1)

    def install(plan: Plan, size: float, run: Run) -> None:
        mass = size / distance
        plan.lumps.append((joint, Segment(mass, along, mass * gyration**2, sign * distance)))

    return dict(
        install=install,
        start=0.2,
        shape=(distance, along, gyration),
        parameters=lambda s: {"mass_moment": sign * s},
    )


def payload(rng, joint, ramp, *, everywhere):
    distance, direction = rng.uniform(0.2, 0.35), either(rng)
    shared = rng.uniform(0.25, 0.75)

    def install(plan: Plan, size: float, run: Run) -> None:
        present = everywhere or run.purpose == "train" or run.rng.random() < 0.5
        share = shared if everywhere else run.rng.uniform(0.25, 0.75)
        if present:
            plan.payload = Payload(joint, distance)
            plan.load = np.array([size / distance, share * run.duration_s, ramp, direction])

    return dict(
        install=install,
        start=0.5,
        slow=True,
        shape=(distance, ramp, direction),
        parameters=lambda s: {"mass_moment": direction * s},
    )


@form("payload_change", own=True)
def sudden(rng, joint):
    return payload(rng, joint, 0.01, everywhere=True)


@form("payload_change")
def over_half_a_second(rng, joint):
    return payload(rng, joint, 0.5, everywhere=False)


# --- Sensors


def _gain(rng, joint, bend):
    sign = either(rng)

    def install(plan: Plan, size: float, run: Run) -> None:
        plan.channel.gain[joint] += sign * size
        plan.channel.bend[joint] += bend * sign * size

    parameters = (lambda s: {"gain": 1.0 + sign * s}) if bend == 0 else (lambda s: {})
    return dict(install=install, start=0.1, shape=(sign, bend), parameters=parameters)


@form("torque_gain", own=True)
def wrong_constant(rng, joint):
    return _gain(rng, joint, 0.0)


@form("torque_gain")
def slightly_bent(rng, joint):
    return _gain(rng, joint, rng.uniform(-0.006, 0.006))


@form("torque_offset", own=True)
def wrong_zero(rng, joint):
    sign = either(rng)

    def install(plan: Plan, size: float, run: Run) -> None:
        plan.channel.offset[joint] += sign * size

    return dict(install=install, start=1.0, parameters=lambda s: {"offset": sign * s})


@form("torque_offset")
def settling(rng, joint):
    """A zero that settles by a tenth of itself while electronics warm."""
    sign, time = either(rng), rng.uniform(10.0, 30.0)

    def install(plan: Plan, size: float, run: Run) -> None:
        plan.channel.offset[joint] += sign * size
        plan.channel.moving_offset[joint].append(lambda t: 0.1 * sign * size * np.exp(-t / time))

    return dict(install=install, start=1.0, shape=(time,))


def drift(curve_of, rng, joint, parameters=lambda s: {}):
    def install(plan: Plan, size: float, run: Run) -> None:
        curve = curve_of(run)
        plan.channel.moving_offset[joint].append(lambda t: size * curve(t))

    return dict(install=install, start=2.0, slow=True, parameters=parameters)


@form("torque_drift", own=True)
def steady(rng, joint):
    sign = either(rng)
    return drift(
        lambda run: lambda t: sign * t / 70.0, rng, joint, lambda s: {"rate": sign * s / 70.0}
    )


@form("torque_drift")
def exponential_approach(rng, joint):
    sign, time = either(rng), rng.uniform(15.0, 40.0)
    return drift(lambda run: lambda t: sign * (1.0 - np.exp(-t / time)), rng, joint)


@form("torque_drift")
def smooth_random_walk(rng, joint):
    return drift(lambda run: random_walk(run.rng, run.duration_s, smoothing_s=6.0), rng, joint)


@form("encoder_offset", own=True)
def wrong_reference(rng, joint):
    sign = either(rng)

    def install(plan: Plan, size: float, run: Run) -> None:
        plan.encoder_offset[joint] += sign * size

    return dict(install=install, start=0.05, largest=0.3, parameters=lambda s: {"offset": sign * s})


@form("encoder_offset")
def with_slight_eccentricity(rng, joint):
    sign, depth, phase = either(rng), rng.uniform(0.05, 0.12), rng.uniform(0.0, 2 * np.pi)

    def install(plan: Plan, size: float, run: Run) -> None:
        plan.encoder_offset[joint] += sign * size
        plan.eccentric(joint, depth * size, phase)

    return dict(install=install, start=0.05, largest=0.3, shape=(depth, phase))


def _late(rng, joint, delay, lag, parameters=lambda s: {}):
    def install(plan: Plan, size: float, run: Run) -> None:
        plan.channel.delay_s[joint] += delay * size
        plan.channel.lag_s[joint] += lag * size

    return dict(
        install=install, start=0.02, largest=0.08, shape=(delay, lag), parameters=parameters
    )


@form("time_delay", own=True)
def pure(rng, joint):
    return _late(rng, joint, 1.0, 0.0, lambda s: {"delay": s})


@form("time_delay")
def delay_and_lag(rng, joint):
    lag = rng.uniform(0.3, 0.8)
    return _late(rng, joint, 1.0 - lag, lag)


# --- The person


def _end_range(kind, rng, joint, reach, *sharpness):
    side = either(rng)
    low, high = reach[0][joint], reach[1][joint]
    depth = rng.uniform(0.25, 0.45) * (high - low)
    onset = high - depth if side > 0 else low + depth
    return dict(
        install=hidden_torque(kind, joint, onset, *sharpness, side, human=True),
        start=2.0,
        human=True,
        shape=(onset, *sharpness, side),
    )


@form("passive_joint_torque", own=True)
def exponential_stiffness(rng, joint, reach):
    return _end_range(smooth.END_EXPONENTIAL, rng, joint, reach, rng.uniform(4.0, 9.0))


@form("passive_joint_torque")
def tanh_stop(rng, joint, reach):
    return _end_range(smooth.END_TANH, rng, joint, reach, rng.uniform(4.0, 9.0))


@form("passive_joint_torque")
def quadratic_stop(rng, joint, reach):
    return _end_range(smooth.END_POWER, rng, joint, reach, 2.0)


@form("passive_joint_torque")
def cubic_stop(rng, joint, reach):
    return _end_range(smooth.END_POWER, rng, joint, reach, 3.0)


def _rhythm(kind, rng, joint, depth):
    frequency = rng.uniform(0.13, 0.95)
    slow = rng.uniform(0.02, 0.08, 2)

    def install(plan: Plan, size: float, run: Run) -> None:
        if run.has_human:
            phases = run.rng.uniform(0.0, 2 * np.pi, 2)
            plan.torque(
                kind, joint, size, frequency, phases[0], depth, *slow, phases[1], human=True
            )

    own = kind == smooth.RHYTHM
    return dict(
        install=install,
        start=2.0,
        human=True,
        slow=True,
        shape=(frequency, depth),
        parameters=lambda s: {"amplitude": s, "frequency": frequency} if own else {},
    )


@form("voluntary_torque", own=True)
def sine(rng, joint):
    return _rhythm(smooth.RHYTHM, rng, joint, 0.0)


@form("voluntary_torque")
def wandering_rhythm(rng, joint):
    return _rhythm(smooth.RHYTHM_WANDERING, rng, joint, rng.uniform(0.03, 0.15))


@form("voluntary_torque")
def pushes(rng, joint):
    return _rhythm(smooth.RHYTHM_BURSTS, rng, joint, rng.uniform(0.02, 0.1))


def _reflex(kind, rng, joint, *more):
    threshold, side = rng.uniform(0.2, 0.6), either(rng)
    return dict(
        install=hidden_torque(kind, joint, threshold, side, *more, human=True),
        start=5.0,
        human=True,
        shape=(threshold, side, *more),
        parameters=lambda s: (
            {"gain": s, "threshold_velocity": threshold} if kind == smooth.REFLEX else {}
        ),
    )


@form("spasticity", own=True)
def above_a_threshold(rng, joint):
    return _reflex(smooth.REFLEX, rng, joint)


@form("spasticity")
def smooth_threshold_with_latency(rng, joint):
    return _reflex(
        smooth.REFLEX_SMOOTH, rng, joint, rng.uniform(0.03, 0.12), rng.uniform(0.02, 0.05)
    )


FIRM_CUFF = (15000.0, 60.0, 0.0, 0.0, 0.0, 0.0)
"""The other cuff of a wearer whose leg is one of its own, as ``Plan.cuffs``."""


def limb(rng, joint, hardens, slack=0.0, creep=(0.0, 0.0)):
    lag = rng.uniform(0.01, 0.03)

    def install(plan: Plan, size: float, run: Run) -> None:
        if run.has_human:
            if plan.cuffs is None:
                plan.cuffs = np.array([FIRM_CUFF, FIRM_CUFF])
            plan.cuffs[joint] = 1.0 / size, lag / size, hardens, slack, *creep

    return dict(
        install=install,
        start=1 / 600.0,
        smallest=1 / 5000.0,
        largest=1 / 60.0,
        human=True,
        shape=(lag, hardens),
        parameters=lambda s: {"stiffness": 1.0 / s} if hardens == 0 else {},
    )


@form("cuff_compliance")
def kelvin_voigt_limb(rng, joint):
    return limb(rng, joint, 0.0)


@form("cuff_compliance")
def hardening_limb(rng, joint):
    return limb(rng, joint, log_uniform(rng, 20.0, 150.0))


PLAIN_CAUSES = tuple(FORMS)
"""What the first examinations hid; ``further_forms`` adds to it."""
SOFT = ("backlash", "joint_elasticity")
"""Causes that part the motor from its link."""
HUMAN_CAUSES = ("passive_joint_torque", "voluntary_torque", "spasticity", "cuff_compliance")


def random_cause(
    rng: Generator,
    effect: str,
    joint: int | None,
    form_name: str | None = None,
    world: str | None = None,
    reach: Reach = BOUNDS,
) -> Cause:
    """Draw one form of a cause, or the form of that name; shape and all.

    Without a world the forms are those of plain cases.
    """
    known = [f for f in FORMS[effect] if (f.plain if world is None else world in f.worlds)]
    # What the first examinations did not hide has no plain forms: a machine of one joint takes any.
    known = known or [f for f in FORMS[effect] if WORLDS[0] in f.worlds and not f.warm]
    forms = [f for f in known if form_name in (None, f.form)]
    return forms[int(rng.integers(len(forms)))](rng, joint, reach)
