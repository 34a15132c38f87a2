"""Forms of causes that the first examinations did not have: no plain case draws them.

Those of causes that the first examinations hid are found in one or two worlds only, so that no
world has the habits of another.
"""

import numpy as np

from tests.campaigns.blind import dry
from tests.campaigns.blind import further_torques as further
from tests.campaigns.blind.body import Segment
from tests.campaigns.blind.causes import (
    BOUNDS,
    WORLDS,
    drift,
    either,
    elastic,
    form,
    hidden_torque,
    limb,
    log_uniform,
    payload,
    play,
)
from tests.campaigns.blind.plan import Plan, Run
from tests.campaigns.blind.transmissions import ELASTIC, PLAY_GREASED, PLAY_ROUNDED, SOFTENING
from tests.campaigns.blind.wandering import random_walk

PLANAR, TWO_MASS, NEW_WORLDS = ("planar",), ("two_mass",), ("planar", "two_mass")


def new(effect, worlds=WORLDS, *, own=False, warm=False):
    """Register a form that plain cases do not draw."""
    return form(effect, own=own, worlds=worlds, plain=False, warm=warm)


# --- Dry and viscous friction


@new("stribeck_friction", PLANAR)
def stretched_exponential(rng, joint):
    shape = rng.uniform(0.12, 0.4), float(rng.choice([0.6, 0.8, 1.5]))
    install = hidden_torque(dry.STRIBECK_STRETCHED, joint, *shape)
    return dict(install=install, start=3.0, shape=shape)


@new("stribeck_friction", TWO_MASS)
def hyperbolic(rng, joint):
    shape = (rng.uniform(0.15, 0.5),)
    return dict(
        install=hidden_torque(dry.STRIBECK_HYPERBOLIC, joint, *shape), start=3.0, shape=shape
    )


@new("coulomb_asymmetry", PLANAR)
def rational_transition(rng, joint):
    shape = (rng.uniform(0.02, 0.1),)
    install = hidden_torque(dry.ASYMMETRY_RATIONAL, joint, *shape, sign=either(rng))
    return dict(install=install, start=1.0, shape=shape)


@new("coulomb_asymmetry", TWO_MASS)
def rising_with_load(rng, joint):
    shape = (rng.uniform(40.0, 120.0),)
    install = hidden_torque(dry.ASYMMETRY_LOADED, joint, *shape, sign=either(rng))
    return dict(install=install, start=1.0, shape=shape)


def _viscous_asymmetry(kind, rng, joint, *shape):
    install = hidden_torque(kind, joint, *shape, sign=either(rng))
    return dict(install=install, start=2.0, shape=shape)


@new("viscous_asymmetry", PLANAR)
def saturating(rng, joint):
    return _viscous_asymmetry(
        further.VISCOUS_ASYMMETRY_SATURATING, rng, joint, rng.uniform(1.0, 4.0)
    )


@new("viscous_asymmetry", TWO_MASS)
def power_of_speed(rng, joint):
    return _viscous_asymmetry(further.VISCOUS_ASYMMETRY_POWER, rng, joint, rng.uniform(0.8, 1.3))


@new("load_dependent_friction", PLANAR)
def in_quadrature_with_a_preload(rng, joint):
    shape = (rng.uniform(2.0, 8.0),)
    install = hidden_torque(dry.LOAD_QUADRATURE, joint, *shape)
    return dict(install=install, start=0.1, largest=0.5, shape=shape)


@new("load_dependent_friction", TWO_MASS)
def saturating_with_load(rng, joint):
    shape = (rng.uniform(30.0, 100.0),)
    install = hidden_torque(dry.LOAD_SATURATING, joint, *shape)
    return dict(install=install, start=0.1, largest=0.5, shape=shape)


@new("load_dependent_friction", ("mujoco",))
def lopsided(rng, joint):
    """A gear that loses a share of the torque where it drives, and none where it is driven."""
    return dict(install=hidden_torque(dry.LOAD_LOPSIDED, joint), start=0.1, largest=0.5)


@new("quadratic_drag", PLANAR)
def with_a_cubic_part(rng, joint):
    shape = (rng.uniform(0.1, 0.5),)
    return dict(install=hidden_torque(further.DRAG_CUBIC, joint, *shape), start=2.0, shape=shape)


@new("quadratic_drag", TWO_MASS)
def vented(rng, joint):
    """A damper with a valve that opens at speed."""
    shape = (rng.uniform(2.0, 6.0),)
    return dict(install=hidden_torque(further.DRAG_VENTED, joint, *shape), start=2.0, shape=shape)


@new("presliding_hysteresis", PLANAR)
def dahl_with_an_exponent(rng, joint):
    shape = log_uniform(rng, 0.015, 0.1), float(rng.choice([0.5, 1.5]))
    return dict(install=hidden_torque(further.DAHL_EXPONENT, joint, *shape), start=1.5, shape=shape)


@new("presliding_hysteresis", TWO_MASS)
def elasto_plastic(rng, joint):
    shape = log_uniform(rng, 0.015, 0.1), rng.uniform(0.3, 0.8)
    install = hidden_torque(further.ELASTO_PLASTIC, joint, *shape)
    return dict(install=install, start=1.5, shape=shape)


def _warm_up(coulomb_kind, viscous_kind, rng, joint, times):
    share = rng.uniform(0.0, 0.6)
    viscous = (1.0 - share) / 0.6

    def install(plan: Plan, size: float, run: Run) -> None:
        plan.torque(coulomb_kind, joint, size * share, *times)
        plan.torque(viscous_kind, joint, size * viscous, *times)

    return dict(install=install, start=2.0, slow=True, shape=(*times, share))


@new("friction_warmup", PLANAR)
def with_two_time_constants(rng, joint):
    times = rng.uniform(5.0, 12.0), rng.uniform(30.0, 70.0)
    return _warm_up(dry.WARMUP_TWO, further.WARM_VISCOUS_TWO, rng, joint, times)


@new("friction_warmup", TWO_MASS)
def after_a_while(rng, joint):
    """The gear's grease stays stiff until warmth has come through."""
    times = rng.uniform(10.0, 25.0), rng.uniform(4.0, 9.0)
    return _warm_up(dry.WARMUP_LATE, further.WARM_VISCOUS_LATE, rng, joint, times)


# --- Ripple


def _lines(rng, joint, lowest, highest):
    """Draw number and phases of a line, and shares of those at half, twice and another number."""
    cycles = np.round(log_uniform(rng, lowest, highest))
    half, twice = rng.uniform(0.0, 0.8), rng.uniform(0.0, 0.6)
    other, number = rng.uniform(0.0, 0.7), np.round(cycles * rng.uniform(0.3, 1.7))
    phase, second = rng.uniform(0.0, 2 * np.pi, 2)
    return float(cycles), phase, half, twice, other, float(number), second


@new("cogging", NEW_WORLDS)
def two_unrelated_lines(rng, joint):
    cycles, phase, _, _, _, number, second = _lines(rng, joint, 8.0, 60.0)
    shape = cycles, phase, 0.0, 0.0, rng.uniform(0.4, 1.0), number, second
    return dict(install=hidden_torque(further.COGGING_LINES, joint, *shape), start=1.0, shape=shape)


def _in_the_channel(joint, shape, parameters=None):
    """Return a ripple of the torque that follows the motor's angle without delay, however fine."""
    cycles, phase, half, twice, other, number, second = shape

    def install(plan: Plan, size: float, run: Run) -> None:
        def ripple(angle):
            lines = np.sin(cycles * angle + phase)
            lines = lines + half * np.sin(0.5 * cycles * angle + 2.0 * phase)
            lines = lines + twice * np.sin(2.0 * cycles * angle + second)
            return size * (lines + other * np.sin(number * angle + second))

        plan.channel.ripple[joint].append(ripple)

    return dict(
        install=install, start=1.0, shape=shape, fast=True, parameters=parameters or (lambda s: {})
    )


@new("cogging", own=True)
def one_fine_line(rng, joint):
    cycles = float(np.round(log_uniform(rng, 30.0, 400.0)))
    shape = cycles, rng.uniform(0.0, 2 * np.pi), 0.0, 0.0, 0.0, 1.0, 0.0
    return _in_the_channel(joint, shape, lambda s: {"amplitude": s, "cycles_per_turn": cycles})


@new("cogging")
def wave_gear(rng, joint):
    """Lines at a number of cycles, at half and twice it, and at one of its bearing's."""
    return _in_the_channel(joint, _lines(rng, joint, 20.0, 200.0))


# --- Drive trains


@new("rotor_inertia", NEW_WORLDS)
def counter_rotating(rng, joint):
    """A rotor on the thigh that turns against the knee."""
    ratio = rng.uniform(30.0, 150.0)

    def install(plan: Plan, size: float, run: Run) -> None:
        plan.added_mass += size * np.array([[1 / ratio**2, -1 / ratio], [-1 / ratio, 1.0]])

    return dict(install=install, start=0.2, shape=(ratio,), parameters=lambda s: {"inertia": s})


@new("backlash", PLANAR)
def play_full_of_grease(rng, joint):
    return play(PLAY_GREASED, rng, joint)


@new("backlash", TWO_MASS)
def play_with_rounded_contact(rng, joint):
    return play(PLAY_ROUNDED, rng, joint)


@new("joint_elasticity", PLANAR)
def softening(rng, joint):
    return elastic(SOFTENING, rng, joint, log_uniform(rng, 0.03, 0.15))


@new("joint_elasticity", TWO_MASS)
def lossy(rng, joint):
    """A spring that damps well, as rubber does."""
    loss = rng.uniform(3.0, 8.0)

    def install(plan: Plan, size: float, run: Run) -> None:
        plan.soft(joint, ELASTIC, 1.0 / size, loss * 0.1 * np.sqrt(0.04 / size))

    return dict(
        install=install,
        start=1 / 800.0,
        smallest=1 / 4000.0,
        largest=1 / 90.0,
        shape=(loss,),
        parameters=lambda s: {"stiffness": 1.0 / s},
    )


# --- Structure


@new("parallel_spring", PLANAR)
def giving_way(rng, joint, reach=BOUNDS):
    shape = rng.uniform(reach[0][joint], reach[1][joint]), rng.uniform(0.3, 1.0)
    install = hidden_torque(further.SPRING_SOFTENING, joint, *shape)
    return dict(install=install, start=5.0, shape=shape)


@new("parallel_spring", TWO_MASS)
def wound_on_a_cam(rng, joint, reach=BOUNDS):
    shape = rng.uniform(reach[0][joint], reach[1][joint]), rng.uniform(0.6, 1.2)
    return dict(install=hidden_torque(further.SPRING_SINE, joint, *shape), start=5.0, shape=shape)


@new("base_tilt", NEW_WORLDS)
def slowly_leaning(rng, joint):
    """A stand that gives way by a fifth of its tilt during a run."""
    sign, depth, frequency = either(rng), rng.uniform(0.1, 0.25), rng.uniform(0.001, 0.003)

    def install(plan: Plan, size: float, run: Run) -> None:
        plan.tilt += np.array([sign * size, depth * size, frequency])

    return dict(install=install, start=0.05, largest=0.35, shape=(depth, frequency))


@new("mass_off_axis", NEW_WORLDS)
def two_lumps(rng, joint):
    """A motor and its counterweight, of unequal moments."""
    sign, front, back = either(rng), rng.uniform(0.1, 0.2), rng.uniform(0.05, 0.1)
    along, share = rng.uniform(0.05, 0.3, 2), rng.uniform(0.1, 0.3)

    def install(plan: Plan, size: float, run: Run) -> None:
        whole = size / (1.0 - share)
        plan.lumps.append((joint, Segment(whole / front, along[0], 0.0, sign * front)))
        plan.lumps.append((joint, Segment(share * whole / back, along[1], 0.0, -sign * back)))

    return dict(
        install=install,
        start=0.2,
        shape=(front, back, share),
        parameters=lambda s: {"mass_moment": sign * s},
    )


@new("payload_change", PLANAR)
def over_some_seconds(rng, joint):
    return payload(rng, joint, rng.uniform(2.0, 5.0), everywhere=False)


@new("payload_change", TWO_MASS)
def in_some_runs_only(rng, joint):
    return payload(rng, joint, 0.05, everywhere=False)


@new("end_stop", own=True)
def flat_bumper(rng, joint, reach=BOUNDS):
    return _stop(rng, joint, reach, 1.0)


@new("end_stop", own=True)
def round_bumper(rng, joint, reach=BOUNDS):
    return _stop(rng, joint, reach, 1.5)


def _stop(rng, joint, reach, exponent):
    contact, side = _contact(rng, joint, reach)
    install = hidden_torque(further.STOP_POWER, joint, contact, side, exponent)
    return dict(
        install=install,
        start=20.0,
        shape=(contact, side, exponent),
        parameters=lambda s: {"stiffness": s, "contact_angle": float(contact)},
    )


def _contact(rng, joint, reach):
    """Draw where a stop is touched: in the last third of the range, on either side."""
    side, low, high = either(rng), reach[0][joint], reach[1][joint]
    depth = rng.uniform(0.15, 0.35) * (high - low)
    return (high - depth if side > 0 else low + depth), side


@new("end_stop")
def hardening_with_damping(rng, joint, reach=BOUNDS):
    contact, side = _contact(rng, joint, reach)
    shape = contact, side, rng.uniform(2.0, 10.0), rng.uniform(0.01, 0.05)
    install = hidden_torque(further.STOP_HARDENING, joint, *shape)
    return dict(
        install=install,
        start=20.0,
        shape=shape,
        parameters=lambda s: {"contact_angle": float(contact)},
    )


@new("position_dependent_friction", own=True)
def linear_in_angle(rng, joint, reach=BOUNDS):
    low, high, way = reach[0][joint], reach[1][joint], either(rng)
    middle, span = (low + high) / 2, 1.2 * (high - low)
    return dict(
        install=hidden_torque(dry.POSITION_LINEAR, joint, middle, span, way),
        start=3.0,
        shape=(middle, span, way),
        parameters=lambda s: {"slope": float(way * s / span), "curvature": 0.0},
    )


@new("position_dependent_friction")
def sine_of_angle(rng, joint, reach=BOUNDS):
    """A bearing out of line: its friction rises and falls once or twice over the range."""
    low, high = reach[0][joint], reach[1][joint]
    shape = rng.uniform(low, high), 2 * np.pi * rng.uniform(0.6, 1.6) / (high - low)
    return dict(install=hidden_torque(dry.POSITION_SINE, joint, *shape), start=3.0, shape=shape)


@new("position_dependent_friction")
def one_rough_patch(rng, joint, reach=BOUNDS):
    low, high = reach[0][joint], reach[1][joint]
    span = high - low
    shape = low + rng.uniform(0.2, 0.8) * span, rng.uniform(0.1, 0.3) * span
    return dict(install=hidden_torque(dry.POSITION_PATCH, joint, *shape), start=3.0, shape=shape)


# --- Effects of the temperature


def _share_of_cold(run: Run, joint: int):
    """Return how cold a motor is at 50 Hz, from 1 at the session's coldest to 0 at its warmest."""
    coldest, warmest = run.temperature_range[:, joint]
    return (warmest - run.temperature[:, joint]) / (warmest - coldest)


@new("friction_temperature", own=True, warm=True)
def in_proportion(rng, joint):
    """Both frictions fall by the degree."""
    share = rng.uniform(0.2, 0.7)

    def install(plan: Plan, size: float, run: Run) -> None:
        cold = _share_of_cold(run, joint)
        plan.torque(dry.LEVEL_TABLE, joint, share * size, table=cold)
        plan.torque(further.VISCOUS_TABLE, joint, (1.0 - share) * size / 0.6, table=cold)

    return dict(install=install, start=3.0, slow=True, follows_temperature=True, shape=(share,))


@new("friction_temperature", warm=True)
def viscosity_falls_exponentially(rng, joint):
    depth = rng.uniform(1.5, 4.0)

    def install(plan: Plan, size: float, run: Run) -> None:
        cold = np.exp(depth * (_share_of_cold(run, joint) - 1.0))
        plan.torque(further.VISCOUS_TABLE, joint, size / 0.6, table=cold)

    return dict(install=install, start=3.0, slow=True, follows_temperature=True, shape=(depth,))


@new("friction_temperature", warm=True)
def dry_friction_alone(rng, joint):
    """A seal that softens: faster at first."""
    bend = rng.uniform(0.5, 2.0)

    def install(plan: Plan, size: float, run: Run) -> None:
        cold = _share_of_cold(run, joint)
        plan.torque(dry.LEVEL_TABLE, joint, size, table=cold ** (1.0 + bend))

    return dict(install=install, start=3.0, slow=True, follows_temperature=True, shape=(bend,))


@new("gain_drift", own=True, warm=True)
def with_recorded_temperature(rng, joint):
    sign = either(rng)

    def install(plan: Plan, size: float, run: Run) -> None:
        warm = 1.0 - _share_of_cold(run, joint)
        at = np.arange(len(warm)) / further.TABLE_RATE_HZ
        plan.channel.moving_gain[joint].append(
            lambda t: sign * size * (np.interp(t, at, warm) - 0.5)
        )

    return dict(
        install=install, start=0.2, largest=0.5, slow=True, follows_temperature=True, shape=(sign,)
    )


@new("gain_drift", own=True)
def warming_up(rng, joint):
    sign, time = either(rng), rng.uniform(12.0, 45.0)

    def install(plan: Plan, size: float, run: Run) -> None:
        plan.channel.moving_gain[joint].append(
            lambda t: sign * size * (1.0 - np.exp(-np.maximum(t, 0.0) / time))
        )

    return dict(
        install=install,
        start=0.2,
        largest=0.5,
        slow=True,
        shape=(sign, time),
        parameters=lambda s: {"rate": sign * s / time, "time_constant": time},
    )


@new("gain_drift", own=True)
def evenly(rng, joint):
    sign = either(rng)

    def install(plan: Plan, size: float, run: Run) -> None:
        plan.channel.moving_gain[joint].append(lambda t: sign * size * t / 70.0)

    return dict(
        install=install,
        start=0.2,
        largest=0.5,
        slow=True,
        shape=(sign,),
        parameters=lambda s: {"rate": sign * s / 70.0},
    )


@new("gain_drift", NEW_WORLDS)
def ever_slower(rng, joint):
    sign, time = either(rng), rng.uniform(5.0, 15.0)

    def install(plan: Plan, size: float, run: Run) -> None:
        plan.channel.moving_gain[joint].append(
            lambda t: sign * size * np.log1p(np.maximum(t, 0.0) / time) / 2.0
        )

    return dict(install=install, start=0.2, largest=0.5, slow=True, shape=(sign, time))


# --- Sensors


@new("torque_gain", PLANAR)
def other_by_direction(rng, joint):
    sign, share = either(rng), rng.uniform(-0.2, 0.2)

    def install(plan: Plan, size: float, run: Run) -> None:
        plan.channel.gain[joint] += sign * size
        plan.channel.lopsided[joint] += share * size

    return dict(install=install, start=0.1, shape=(sign, share))


@new("torque_gain", TWO_MASS)
def with_a_dead_band(rng, joint):
    sign, band = either(rng), rng.uniform(0.05, 0.3)

    def install(plan: Plan, size: float, run: Run) -> None:
        plan.channel.gain[joint] += sign * size
        plan.channel.dead_band[joint] = band

    return dict(install=install, start=0.1, shape=(sign, band))


@new("torque_offset", PLANAR)
def a_little_other_in_each_run(rng, joint):
    sign, spread = either(rng), rng.uniform(0.05, 0.2)

    def install(plan: Plan, size: float, run: Run) -> None:
        plan.channel.offset[joint] += sign * size * (1.0 + spread * run.rng.uniform(-1.0, 1.0))

    return dict(install=install, start=1.0, shape=(sign, spread))


@new("torque_offset", TWO_MASS)
def breathing(rng, joint):
    """A zero that follows an air conditioner a little."""
    sign, depth, period = either(rng), rng.uniform(0.03, 0.1), rng.uniform(30.0, 60.0)

    def install(plan: Plan, size: float, run: Run) -> None:
        phase = run.rng.uniform(0.0, 2 * np.pi)
        plan.channel.offset[joint] += sign * size
        plan.channel.moving_offset[joint].append(
            lambda t: depth * size * np.sin(2 * np.pi * t / period + phase)
        )

    return dict(install=install, start=1.0, shape=(sign, depth, period))


@new("torque_drift", PLANAR)
def cycles_of_the_room(rng, joint):
    period = rng.uniform(40.0, 90.0)

    def curve_of(run):
        phase = run.rng.uniform(0.0, 2 * np.pi)
        return lambda t: np.sin(2 * np.pi * t / period + phase) - np.sin(phase)

    return drift(curve_of, rng, joint)


@new("torque_drift", TWO_MASS)
def slow_walk_from_a_settling_zero(rng, joint):
    sign, time = either(rng), rng.uniform(4.0, 12.0)

    def curve_of(run):
        walk = random_walk(run.rng, run.duration_s, smoothing_s=3.0)
        return lambda t: 0.6 * walk(t) + sign * np.exp(-t / time)

    return drift(curve_of, rng, joint)


@new("encoder_offset", PLANAR)
def with_two_waves_a_turn(rng, joint):
    sign, depth, phase = either(rng), rng.uniform(0.03, 0.1), rng.uniform(0.0, 2 * np.pi)

    def install(plan: Plan, size: float, run: Run) -> None:
        plan.encoder_offset[joint] += sign * size
        plan.eccentric(joint, 0.0, 0.0, depth * size, phase)

    return dict(install=install, start=0.05, largest=0.3, shape=(sign, depth, phase))


@new("encoder_offset", TWO_MASS)
def slipping_between_runs(rng, joint):
    sign, spread = either(rng), rng.uniform(0.02, 0.1)

    def install(plan: Plan, size: float, run: Run) -> None:
        plan.encoder_offset[joint] += sign * size * (1.0 + spread * run.rng.uniform(-1.0, 1.0))

    return dict(install=install, start=0.05, largest=0.3, shape=(sign, spread))


def _eccentric(rng, joint, once, twice, thrice=0.0):
    phases = rng.uniform(0.0, 2 * np.pi, 3)

    def install(plan: Plan, size: float, run: Run) -> None:
        waves = (once * size, phases[0], twice * size, phases[1], thrice * size, phases[2])
        plan.eccentric(joint, *waves)

    return dict(
        install=install,
        start=0.04,
        largest=0.25,
        shape=(once, twice, thrice, *phases),
        parameters=lambda s: {"amplitude": once * s, "amplitude_twice": twice * s},
    )


@new("encoder_eccentricity", own=True)
def once_a_turn(rng, joint):
    return _eccentric(rng, joint, 1.0, 0.0)


@new("encoder_eccentricity", own=True)
def twice_a_turn(rng, joint):
    return _eccentric(rng, joint, 0.0, 0.5)


@new("encoder_eccentricity", own=True)
def once_and_twice_a_turn(rng, joint):
    return _eccentric(rng, joint, 1.0, rng.uniform(0.15, 0.5))


@new("encoder_eccentricity", NEW_WORLDS)
def with_a_third_wave(rng, joint):
    """A scale that is not round: it errs three times a turn as well."""
    return _eccentric(rng, joint, 1.0, rng.uniform(0.0, 0.3), rng.uniform(0.05, 0.15))


def _leak(rng, joint, bend, lag_s, parameters):
    sign = either(rng)

    def install(plan: Plan, size: float, run: Run) -> None:
        plan.channel.cross[joint, 1 - joint] += sign * size
        plan.channel.cross_bend[joint] += bend
        plan.channel.cross_lag_s[joint] += lag_s

    parameters_of = (lambda s: {"coupling": sign * s}) if parameters else (lambda s: {})
    return dict(install=install, start=0.1, shape=(sign, bend, lag_s), parameters=parameters_of)


@new("torque_cross_talk", own=True)
def constant_share(rng, joint):
    return _leak(rng, joint, 0.0, 0.0, True)


@new("torque_cross_talk")
def share_that_bends(rng, joint):
    return _leak(rng, joint, rng.uniform(-0.008, 0.008), 0.0, False)


@new("torque_cross_talk")
def share_that_lags(rng, joint):
    return _leak(rng, joint, 0.0, rng.uniform(0.01, 0.06), True)


def _late(joint, delay, lags, parameters=lambda s: {}):
    def install(plan: Plan, size: float, run: Run) -> None:
        plan.channel.delay_s[joint] += delay * size
        plan.channel.lag_s[joint] += lags[0] * size
        plan.channel.second_lag_s[joint] += lags[1] * size

    return dict(install=install, start=0.02, largest=0.08, shape=(delay, *lags))


@new("time_delay", PLANAR)
def two_lags(rng, joint):
    share = rng.uniform(0.3, 0.7)
    return _late(joint, 0.0, (share, 1.0 - share))


@new("time_delay", TWO_MASS)
def delay_and_two_lags(rng, joint):
    delay, share = rng.uniform(0.3, 0.8), rng.uniform(0.3, 0.7)
    return _late(joint, delay, ((1.0 - delay) * share, (1.0 - delay) * (1.0 - share)))


# --- The person


@new("passive_joint_torque", PLANAR)
def exponential_at_both_ends(rng, joint, reach=BOUNDS):
    low, high = reach[0][joint], reach[1][joint]
    inward = rng.uniform(0.05, 0.25, 2) * (high - low)
    sharpness = rng.uniform(5.0, 10.0)
    return _passive(
        further.END_BOTH, joint, high - inward[0], sharpness, 1.0, low + inward[1], start=1.0
    )


@new("passive_joint_torque", TWO_MASS)
def rounded_stop(rng, joint, reach=BOUNDS):
    side, low, high = either(rng), reach[0][joint], reach[1][joint]
    depth = rng.uniform(0.2, 0.4) * (high - low)
    onset = high - depth if side > 0 else low + depth
    return _passive(further.END_SOFT_PLUS, joint, onset, rng.uniform(8.0, 25.0), side, start=10.0)


def _passive(kind, joint, *shape, start):
    install = hidden_torque(kind, joint, *shape, human=True)
    return dict(install=install, start=start, human=True, shape=shape)


@new("voluntary_torque", PLANAR)
def two_rhythms(rng, joint):
    frequency, share = rng.uniform(0.13, 0.8), rng.uniform(0.2, 0.5)
    second = frequency * rng.uniform(1.3, 2.7)

    def install(plan: Plan, size: float, run: Run) -> None:
        if run.has_human:
            first, other = run.rng.uniform(0.0, 2 * np.pi, 2)
            plan.torque(
                further.RHYTHM_TWO, joint, size, frequency, first, share, second, other, human=True
            )

    return dict(install=install, start=2.0, human=True, slow=True, shape=(frequency, share, second))


@new("voluntary_torque", TWO_MASS)
def slow_push_quick_release(rng, joint):
    frequency, rise = rng.uniform(0.13, 0.7), rng.uniform(0.55, 0.8)

    def install(plan: Plan, size: float, run: Run) -> None:
        if run.has_human:
            phase = run.rng.uniform(0.0, 2 * np.pi)
            plan.torque(further.RHYTHM_TRIANGLE, joint, size, frequency, phase, rise, human=True)

    return dict(install=install, start=2.0, human=True, slow=True, shape=(frequency, rise))


@new("spasticity", PLANAR)
def power_above_a_threshold(rng, joint):
    shape = rng.uniform(0.2, 0.6), either(rng), float(rng.choice([0.7, 1.5]))
    install = hidden_torque(further.REFLEX_POWER, joint, *shape, human=True)
    return dict(install=install, start=5.0, human=True, shape=shape)


@new("spasticity", TWO_MASS)
def stronger_when_stretched(rng, joint, reach=BOUNDS):
    middle = (reach[0][joint] + reach[1][joint]) / 2
    shape = rng.uniform(0.2, 0.6), either(rng), rng.uniform(0.5, 1.5), middle
    install = hidden_torque(further.REFLEX_BY_LENGTH, joint, *shape, human=True)
    return dict(install=install, start=5.0, human=True, shape=shape)


@new("cuff_compliance", PLANAR)
def strap_with_slack(rng, joint):
    return limb(rng, joint, 0.0, slack=rng.uniform(0.005, 0.02))


@new("cuff_compliance", TWO_MASS)
def flesh_that_creeps(rng, joint):
    return limb(rng, joint, 0.0, creep=(rng.uniform(0.2, 0.5), rng.uniform(0.3, 2.0)))
