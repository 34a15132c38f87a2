"""Hidden torques that the first examinations did not have: functions of motion, time and memories.

As in ``smooth.py``: each form is a number, its parameters ``p``, memories ``m``, and a branch, with
the sign of the torque that the drive must add. Sources: elasto-plastic friction after Dupont,
Hayward, Armstrong, Altpeter (2002), IEEE TAC 47(5); Dahl's exponent after Dahl (1976), AIAA J.
14(12); contact with damping after Hunt and Crossley (1975), J. Appl. Mech. 42(2).
"""

from math import cos, exp, log, pi, sin, sqrt, tanh

from tests.campaigns.blind.compiled import njit

FURTHER = 50
"""The first number of these forms; those from ``dry.FIRST_DRY_AGAIN`` on are dry friction."""
VISCOUS_ASYMMETRY_SATURATING, VISCOUS_ASYMMETRY_POWER = 50, 51
DRAG_CUBIC, DRAG_VENTED = 52, 53
ELASTO_PLASTIC, DAHL_EXPONENT = 54, 55
WARM_VISCOUS_TWO, WARM_VISCOUS_LATE, VISCOUS_TABLE = 56, 57, 58
COGGING_LINES = 59
SPRING_SOFTENING, SPRING_SINE = 60, 61
REFLEX_POWER, REFLEX_BY_LENGTH = 62, 63
END_BOTH, END_SOFT_PLUS = 64, 65
RHYTHM_TWO, RHYTHM_TRIANGLE = 66, 67
STOP_POWER, STOP_HARDENING = 68, 69
SLIDING_MASS, OTHER_SPEED_SQUARED, CREEP_SPRING = 70, 71, 72
TABLE_RATE_HZ = 50.0
DEPTH = 0.1
"""rad beyond a contact at which its stiffness is given."""


@njit()
def table_at(table, t):
    """Return a row's value at time ``t``; rows are at 50 Hz from time 0 on."""
    place = min(max(t, 0.0) * TABLE_RATE_HZ, len(table) - 2.0)
    i = int(place)
    return table[i] + (place - i) * (table[i + 1] - table[i])


@njit()
def further_torque(kind, p, m, table, t, dt, j, q, v, a):
    """Return the torque at joint ``j``; memories ``m`` advance by ``dt``."""
    if kind <= DRAG_VENTED:
        return _viscous(kind, p, v[j])
    if kind <= DAHL_EXPONENT:
        return _presliding(kind, p, m, dt, v[j])
    if kind <= VISCOUS_TABLE:
        return _warm(kind, p, table, t) * v[j]
    if kind == COGGING_LINES:
        # A line, others at half and twice its number, and one that has nothing to do with it.
        total = sin(p[1] * q[j] + p[2])
        total += p[3] * sin(0.5 * p[1] * q[j] + 2.0 * p[2]) + p[4] * sin(2.0 * p[1] * q[j] + p[7])
        return p[0] * (total + p[5] * sin(p[6] * q[j] + p[7]))
    if kind == SPRING_SOFTENING:
        x = q[j] - p[1]
        return p[0] * x / sqrt(1.0 + (x / p[2]) ** 2)
    if kind == SPRING_SINE:
        return p[0] * p[2] * sin((q[j] - p[1]) / p[2])
    if kind <= REFLEX_BY_LENGTH:
        return _reflex(kind, p, q[j], v[j])
    if kind <= END_SOFT_PLUS:
        return _end_range(kind, p, q[j])
    if kind <= RHYTHM_TRIANGLE:
        return _rhythm(kind, p, t)
    if kind <= STOP_HARDENING:
        return _stop(kind, p, q[j], v[j])
    return _unlisted(kind, p, m, dt, j, q, v, a)


@njit()
def _viscous(kind, p, v):
    speed = abs(v)
    if kind == VISCOUS_ASYMMETRY_SATURATING:
        return p[0] * speed / (1.0 + speed / p[1])
    if kind == VISCOUS_ASYMMETRY_POWER:
        return p[0] * speed ** p[1]
    if kind == DRAG_CUBIC:
        return p[0] * v * speed * (1.0 + p[1] * speed)
    return p[0] * v * speed / (1.0 + speed / p[1])


@njit()
def _presliding(kind, p, m, dt, v):
    """``p``: friction torque, presliding angle, then where plastic flow begins, or an exponent."""
    force, angle = p[0], p[1]
    share = m[0] / angle
    with_motion = 1.0 if v * share > 0.0 else 0.0
    if kind == ELASTO_PLASTIC:
        flow = min(1.0, max(0.0, (abs(share) - p[2]) / (1.0 - p[2])))
        flow = with_motion * 0.5 * (1.0 - cos(pi * flow))
        m[0] += dt * v * (1.0 - flow * abs(share))
    else:
        rest = 1.0 - share * (1.0 if v > 0.0 else -1.0)
        m[0] += dt * v * abs(rest) ** p[2] * (1.0 if rest > 0.0 else -1.0)
    m[0] = min(angle, max(-angle, m[0]))
    return force * m[0] / angle


@njit()
def _warm(kind, p, table, t):
    """Return the viscous friction of the moment."""
    if kind == VISCOUS_TABLE:
        return p[0] * table_at(table, t)
    return p[0] * warming(kind == WARM_VISCOUS_LATE, p[1], p[2], max(t, 0.0))


@njit()
def warming(late, first, second, t):
    """Return what is left of a cold friction: 1 at first, falling with two times, or late."""
    if late:
        return (1.0 + exp(-first / second)) / (1.0 + exp((t - first) / second))
    return 0.5 * (exp(-t / first) + exp(-t / second))


@njit()
def _reflex(kind, p, q, v):
    """``p``: gain, threshold speed, side, then an exponent, or a slope with the angle and its
    zero."""
    over = max(0.0, p[2] * v - p[1])
    if kind == REFLEX_POWER:
        return p[2] * p[0] * over ** p[3]
    return p[2] * p[0] * over * max(0.0, 1.0 + p[3] * p[2] * (q - p[4]))


@njit()
def _end_range(kind, p, q):
    """``p``: torque scale, onset, sharpness (1/rad), side; at both ends: the other end's onset."""
    if kind == END_BOTH:
        return p[0] * (exp(p[2] * (q - p[1])) - exp(-p[2] * (q - p[4])))
    x = (q - p[1]) * p[3] * p[2]
    return p[3] * p[0] / p[2] * (log(1.0 + exp(x)) if x < 30.0 else x)


@njit()
def _rhythm(kind, p, t):
    """``p``: amplitude, frequency, phase, then a second line's share, frequency and phase."""
    if kind == RHYTHM_TWO:
        second = p[3] * sin(2.0 * pi * p[4] * t + p[5])
        return p[0] * (sin(2.0 * pi * p[1] * t + p[2]) + second)
    place = (p[1] * t + p[2] / (2.0 * pi)) % 1.0
    # Slowly up, quickly down, its corners rounded by a smooth step.
    up = place / p[3] if place < p[3] else (1.0 - place) / (1.0 - p[3])
    return p[0] * 1.4 * (2.0 * up * up * (3.0 - 2.0 * up) - 1.0)


@njit()
def _stop(kind, p, q, v):
    """``p``: stiffness at ``DEPTH``, contact, side, then an exponent, or a hardening and
    damping."""
    depth = p[2] * (q - p[1])
    if depth <= 0.0:
        return 0.0
    if kind == STOP_POWER:
        return p[2] * p[0] * DEPTH * (depth / DEPTH) ** p[3]
    push = p[0] * depth * (1.0 + p[3] * depth) + p[4] * p[0] * min(1.0, depth / 0.02) * p[2] * v
    return p[2] * max(0.0, push)


@njit()
def _unlisted(kind, p, m, dt, j, q, v, a):
    if kind == OTHER_SPEED_SQUARED:
        other = v[1 - j]
        return p[0] * other * abs(other)
    if kind == CREEP_SPRING:
        # A spring whose rest follows the joint: foam, or a strap that creeps.
        x = q[j] - p[1]
        m[0] += dt / p[2] * (x - m[0])
        return p[0] * (x - p[3] * m[0])
    # A lump of one kilogram's moment that slides along the segment as it swings, and acts on its
    # weight and its inertia; the acceleration through a lag of 5 ms, as it is that of the last
    # step.
    absolute = q[0] if j == 0 else q[0] + q[1]
    turn = tanh((q[j] - p[1]) / p[2])
    place = p[3] * (1.0 + 0.6 * turn)
    slope = p[3] * 0.6 * (1.0 - turn * turn) / p[2]
    push = a[0] if j == 0 else a[0] + a[1]
    m[0] += dt / 0.005 * (push - m[0])
    weight = 9.81 * (place * sin(absolute) - slope * cos(absolute))
    return p[0] * (weight + place * place * m[0] + place * slope * v[j] * v[j])
