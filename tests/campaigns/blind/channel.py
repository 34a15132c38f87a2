"""The torque channel: what becomes of a joint's torque between motor and file."""

from collections.abc import Callable
from dataclasses import dataclass, field

import numpy as np
from numpy.typing import NDArray
from scipy.signal import lfilter

OfTime = Callable[[NDArray], NDArray]
OfTorqueAndSpeed = Callable[[NDArray, NDArray], NDArray]


@dataclass
class Channel:
    """Errors of the measured torque, of hip and knee; arrays (2,) unless stated otherwise."""

    gain: NDArray = field(default_factory=lambda: np.ones(2))
    bend: NDArray = field(default_factory=lambda: np.zeros(2))
    """Change of gain per N·m of the torque's size."""
    lopsided: NDArray = field(default_factory=lambda: np.zeros(2))
    """Change of gain that is added to positive torque and taken from negative torque."""
    fade: NDArray = field(default_factory=lambda: np.zeros((2, 2)))
    """Change of gain as the sensor warms, and its time constant."""
    moving_gain: tuple[list[OfTime], ...] = field(default_factory=lambda: ([], []))
    """Changes of gain with time, a list for each joint."""
    offset: NDArray = field(default_factory=lambda: np.zeros(2))
    moving_offset: tuple[list[OfTime], ...] = field(default_factory=lambda: ([], []))
    """Offsets that move with time, N·m, a list for each joint."""
    delay_s: NDArray = field(default_factory=lambda: np.zeros(2))
    lag_s: NDArray = field(default_factory=lambda: np.zeros(2))
    second_lag_s: NDArray = field(default_factory=lambda: np.zeros(2))
    cross: NDArray = field(default_factory=lambda: np.zeros((2, 2)))
    """Share of the other joint's torque that leaks in."""
    cross_bend: NDArray = field(default_factory=lambda: np.zeros(2))
    """Change of that share per N·m of the leaking torque's size."""
    cross_lag_s: NDArray = field(default_factory=lambda: np.zeros(2))
    ripple: tuple[list[OfTime], ...] = field(default_factory=lambda: ([], []))
    """Torques that the channel adds by the motor's angle, a list for each joint."""
    of_speed: tuple[list[OfTorqueAndSpeed], ...] = field(default_factory=lambda: ([], []))
    """Torques that the channel adds by torque and the motor's speed, a list for each joint."""
    quantum: NDArray = field(default_factory=lambda: np.zeros(2))
    """Step of the reported torque, N·m; 0 where there is none."""
    dead_band: NDArray = field(default_factory=lambda: np.zeros(2))
    """Torque below which 0 is reported, N·m."""
    hold_s: NDArray = field(default_factory=lambda: np.zeros(2))
    """Time for which a reported torque stays the same; 0 where it never does."""

    @property
    def needs_angle(self) -> bool:
        """Whether any part depends on the motors' angles."""
        return any(self.ripple) or any(self.of_speed)


def through(channel: Channel, torque: NDArray, period_s: float, angle: NDArray | None) -> NDArray:
    """Return what the channel makes of a torque.

    Parameters
    ----------
    torque : (n, 2) array
        N·m, each ``period_s`` from time 0 on.
    angle : (n, 2) array or None
        Of the motors, rad; needed where the channel ``needs_angle``.
    """
    t = np.arange(len(torque)) * period_s
    mixed = torque @ (np.eye(2) + _linear(channel)).T
    out = np.empty_like(torque)
    for j in range(2):
        x = mixed[:, j]
        if _leaks_otherwise(channel, j):
            x = x + _leak(channel, j, torque[:, 1 - j], period_s)
        x = np.interp(t - channel.delay_s[j], t, x)
        for lag in (channel.lag_s[j], channel.second_lag_s[j]):
            x = _lagging(x, lag, period_s)
        change, time = channel.fade[j]
        fade = change * (1.0 - np.exp(-t / time)) if time > 0 else 0.0
        x = x * (channel.gain[j] + channel.bend[j] * np.abs(x) + fade)
        if channel.lopsided[j]:
            x = x * (1.0 + channel.lopsided[j] * np.sign(x))
        for change_at in channel.moving_gain[j]:
            x = x * (1.0 + change_at(t))
        x = x + channel.offset[j]
        for moving in channel.moving_offset[j]:
            x = x + moving(t)
        for added in channel.of_speed[j]:
            x = x + added(torque[:, j], np.gradient(angle[:, j], period_s))
        for ripple in channel.ripple[j]:
            x = x + ripple(angle[:, j])
        out[:, j] = _digital(channel, j, x, period_s)
    return out


def _linear(channel: Channel) -> NDArray:
    """Return the shares (2, 2) of each other's torques that leak in as they are."""
    shares = channel.cross.copy()
    for j in range(2):
        if _leaks_otherwise(channel, j):
            shares[j, 1 - j] = 0.0
    return shares


def _leaks_otherwise(channel: Channel, joint: int) -> bool:
    return bool(channel.cross_bend[joint] or channel.cross_lag_s[joint])


def _leak(channel: Channel, joint: int, other: NDArray, period_s: float) -> NDArray:
    share = channel.cross[joint, 1 - joint] * (1.0 + channel.cross_bend[joint] * np.abs(other))
    return _lagging(share * other, channel.cross_lag_s[joint], period_s)


def _lagging(x: NDArray, lag_s: float, period_s: float) -> NDArray:
    """Pass through a lag of first order."""
    if lag_s <= 0:
        return x
    share = 1.0 - np.exp(-period_s / lag_s)
    return lfilter([share], [1.0, share - 1.0], x, zi=[(1.0 - share) * x[0]])[0]


def _digital(channel: Channel, joint: int, x: NDArray, period_s: float) -> NDArray:
    """Hold, round and blank what is reported."""
    if channel.hold_s[joint] > 0:
        every = max(1, round(channel.hold_s[joint] / period_s))
        x = x[np.arange(len(x)) // every * every]
    if channel.dead_band[joint] > 0:
        x = np.where(np.abs(x) < channel.dead_band[joint], 0.0, x)
    if channel.quantum[joint] > 0:
        x = channel.quantum[joint] * np.round(x / channel.quantum[joint])
    return x
