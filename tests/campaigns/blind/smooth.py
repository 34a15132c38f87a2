"""Hidden torques that are functions of motion, time and a few memories.

Each form is a number, its parameters ``p``, memories ``m``, and a branch below. The sign is that of
the torque the drive must add. Sources: LuGre after Canudas de Wit, Olsson, Astrom, Lischinsky
(1995), IEEE TAC 40(3); Bouc-Wen after Wen (1976), J. Eng. Mech. 102(2); Maxwell slip after
Al-Bender, Lampaert, Swevers (2005), IEEE TAC 50(11); passive joint torque after Riener and Edrich
(1999), J. Biomech. 32(5).
"""

from math import cos, exp, log, pi, sin, sqrt, tanh

from tests.campaigns.blind.compiled import njit
from tests.campaigns.blind.further_torques import FURTHER, further_torque

VISCOUS_ASYMMETRY, VISCOUS_ASYMMETRY_SMOOTH = 20, 21
DRAG = 22
DAHL, LUGRE, BOUC_WEN, MAXWELL_SLIP = 23, 24, 25, 26
WARM_VISCOUS_EXPONENTIAL, WARM_VISCOUS_POWER = 27, 28
COGGING = 29
SPRING = 30
END_EXPONENTIAL, END_TANH, END_POWER = 31, 32, 33
RHYTHM, RHYTHM_WANDERING, RHYTHM_BURSTS = 34, 35, 36
REFLEX, REFLEX_SMOOTH = 37, 38
TONE, BOTH_SPEEDS, BIARTICULAR, RINGING, TABLE = 40, 41, 42, 43, 44
DEAD_ZONE, DETENT, ROUGH = 45, 46, 47
MEMORIES = 6
TABLE_RATE_HZ = 50.0


@njit()
def smooth_torque(kind, p, m, table, t, dt, j, q, v, a):
    """Torque at joint ``j`` for angles, speeds and accelerations (2,); memories ``m`` advance by
    ``dt``."""
    if kind >= FURTHER:
        return further_torque(kind, p, m, table, t, dt, j, q, v, a)
    if kind <= DRAG:
        return _viscous(kind, p, v[j])
    if kind <= MAXWELL_SLIP:
        return _presliding(kind, p, m, dt, v[j])
    if kind == WARM_VISCOUS_EXPONENTIAL:
        return p[0] * exp(-max(t, 0.0) / p[1]) * v[j]
    if kind == WARM_VISCOUS_POWER:
        return p[0] / (1.0 + max(t, 0.0) / p[1]) * v[j]
    if kind == COGGING:
        return p[0] * (sin(p[1] * q[j] + p[2]) + p[3] * sin(2.0 * p[1] * q[j] + p[4]))
    if kind == SPRING:
        x = q[j] - p[1]
        return p[0] * (x * (1.0 + p[2] * x * x) + p[3] * v[j])
    if kind <= END_POWER:
        return _end_range(kind, p, q[j])
    if kind <= RHYTHM_BURSTS:
        return _rhythm(kind, p, m, t, dt)
    if kind <= REFLEX_SMOOTH:
        return _reflex(kind, p, m, dt, v[j])
    return _uncatalogued(kind, p, m, table, t, dt, j, q, v, a)


@njit()
def _viscous(kind, p, v):
    if kind == VISCOUS_ASYMMETRY:
        return p[0] * abs(v)
    if kind == VISCOUS_ASYMMETRY_SMOOTH:
        return p[0] * (sqrt(v * v + p[1] * p[1]) - p[1])
    return p[0] * abs(v) ** p[1] * (1.0 if v > 0 else -1.0)


@njit()
def _presliding(kind, p, m, dt, v):
    """``p``: friction torque, presliding angle, exponent or damping; memories hold the bristles, in
    rad."""
    force, angle = p[0], p[1]
    if kind == MAXWELL_SLIP:
        total = 0.0
        for i in range(3):
            yields = angle * (0.4 + 0.8 * i)
            m[i] = min(yields, max(-yields, m[i] + dt * v))
            total += m[i] / yields / 3.0
        return force * total
    if kind == DAHL:
        # Exact for constant speed over the step.
        target = angle if v > 0 else -angle
        m[0] = target + (m[0] - target) * exp(-abs(v) * dt / angle)
        return force * m[0] / angle
    if kind == LUGRE:
        level = force * (1.0 + 0.2 * exp(-((v / 0.08) ** 2)))
        stiffness = force / angle
        rate = v - stiffness * abs(v) / level * m[0]
        m[0] += dt * rate
        return stiffness * m[0] + p[2] * rate
    share = m[0] / angle
    m[0] += dt * v * (1.0 - abs(share) ** p[2] * (1.0 if v * share > 0 else -0.5))
    m[0] = min(angle, max(-angle, m[0]))
    return force * m[0] / angle


@njit()
def _end_range(kind, p, q):
    """``p``: torque scale, onset, sharpness (1/rad) or power, side (+1: beyond the onset
    upward)."""
    x = (q - p[1]) * p[3]
    if kind == END_EXPONENTIAL:
        return p[3] * p[0] * exp(p[2] * x)
    if kind == END_TANH:
        return p[3] * p[0] * 0.5 * (1.0 + tanh(p[2] * x))
    return p[3] * p[0] * max(0.0, x) ** p[2]


@njit()
def _rhythm(kind, p, m, t, dt):
    """``p``: amplitude, frequency, phase, depth of wandering and two slow frequencies of it."""
    if kind == RHYTHM:
        return p[0] * sin(2.0 * pi * p[1] * t + p[2])
    wander = 1.0 + p[3] * (
        sin(2.0 * pi * p[4] * t + p[6]) + 0.6 * sin(2.0 * pi * p[5] * t + 2.0 * p[6])
    )
    m[0] += dt * 2.0 * pi * p[1] * wander
    beat = sin(m[0] + p[2])
    if kind == RHYTHM_BURSTS:
        return p[0] * max(0.0, beat) ** 1.5 * 1.7
    return p[0] * beat * (1.0 + p[3] * sin(2.0 * pi * p[5] * t))


@njit()
def _reflex(kind, p, m, dt, v):
    """``p``: gain, threshold speed, side, smoothness (rad/s), latency (s)."""
    over = p[2] * v - p[1]
    if kind == REFLEX:
        return p[2] * p[0] * max(0.0, over)
    m[0] += dt / p[4] * (p[3] * log(1.0 + exp(min(50.0, over / p[3]))) - m[0])
    return p[2] * p[0] * m[0]


@njit()
def _uncatalogued(kind, p, m, table, t, dt, j, q, v, a):
    if kind == TONE:
        return p[0] * sin(2.0 * pi * p[1] * t + p[2])
    if kind == BOTH_SPEEDS:
        return p[0] * v[0] * v[1]
    if kind == BIARTICULAR:
        # A band across both joints, which pulls only: its moment arm at this joint is p[3].
        return p[0] * p[3] * max(0.0, p[1] * q[0] + p[2] * q[1] - p[4])
    if kind == RINGING:
        # A cover or cable that rings at p[1] Hz whenever this joint reverses.
        m[2] += dt
        if v[j] * m[3] < 0.0 and m[2] > 0.3:
            m[2] = 0.0
        m[3] = v[j]
        return p[0] * exp(-m[2] / p[2]) * cos(2.0 * pi * p[1] * m[2])
    if kind == DEAD_ZONE:
        return p[0] * max(0.0, abs(v[j]) - p[1]) * (1.0 if v[j] > 0 else -1.0)
    if kind == DETENT:
        x = (q[j] - p[1]) / p[2]
        return p[0] * x * exp(0.5 - 0.5 * x * x)
    if kind == ROUGH:
        return p[0] * 0.5 * (1.0 + tanh(p[3] * (q[j] - p[1]) / p[2])) * tanh(v[j] / 0.01)
    place = min(max(t, 0.0) * TABLE_RATE_HZ, len(table) - 2.0)
    i = int(place)
    return p[0] * (table[i] + (place - i) * (table[i + 1] - table[i]))
