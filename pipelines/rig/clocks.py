"""A virtual device's own clock, whose sampling instants drift against those of other devices."""

from collections.abc import Sequence
from dataclasses import fields, replace

import numpy as np
from numpy.typing import NDArray

from pipelines.rig.plant import Samples
from pipelines.signals.interpolation import cubic_weights


class OwnClock:
    """Samples of a device whose clock gains ``ppm`` and began at ``offset_s``, from the plant's."""

    def __init__(self, ppm: float, offset_s: float, rate_hz: float, plant_rate_hz: float) -> None:
        self._rate = rate_hz
        self._plant_rate = plant_rate_hz
        self._gain = 1.0 + 1e-6 * ppm
        self._offset_s = offset_s
        self._sampled = 0
        self._seen: list[Samples] = []

    def sampled(self, chunk: Samples) -> Samples:
        """Add the plant's newest samples; return the device's new samples.

        Parameters
        ----------
        chunk : Samples
            At the plant's rate.

        Returns
        -------
        Samples
            Interpolated at the device's instants; none between two of them.
        """
        # Samples of the plant from a device's sampling instant until the sample is available.
        # So the cubic always has two samples of the plant after the instant.
        delay = 2.5
        self._seen.append(chunk)
        latest = (chunk.sequence[-1] + 1 - delay) / self._plant_rate
        count = int(latest * self._rate * self._gain + 0.5)
        if count <= self._sampled:
            return chunk[:0]
        numbers, self._sampled = np.arange(self._sampled, count), count
        seen = _joined(self._seen)
        self._seen = [seen[-16:]]  # more than the cubics need
        instants = (numbers + 0.5) / (self._rate * self._gain)
        values = _between(
            seen, np.maximum(instants * self._plant_rate - 0.5 - seen.sequence[0], 0.0)
        )
        # By the device's own clock, samples are exactly one nominal period apart, however fast it
        # runs.
        began = round(self._offset_s * self._rate)
        return replace(
            values, sequence=began + numbers, time=self._offset_s + instants * self._gain
        )


def _between(seen: Samples, at: NDArray) -> Samples:
    """Interpolate the plant's samples at fractional places ``at`` (k,) by cubic polynomials."""
    # Four samples around the place, the outermost at -1 and 2; at the ends the nearest four.
    base = np.clip(np.floor(at).astype(int), 1, max(len(seen.time) - 3, 1))
    x = at - base
    weights = np.stack(cubic_weights(x))
    places = np.minimum(base + np.arange(-1, 3)[:, np.newaxis], len(seen.time) - 1)
    return Samples(
        **{f.name: _weighted(getattr(seen, f.name), places, weights) for f in fields(Samples)}
    )


def _weighted(values: NDArray, places: NDArray, weights: NDArray) -> NDArray:
    shape = (*weights.shape, *(1,) * (values.ndim - 1))
    return (weights.reshape(shape) * values[places]).sum(axis=0)


def _joined(chunks: Sequence[Samples]) -> Samples:
    return Samples(
        **{f.name: np.concatenate([getattr(c, f.name) for c in chunks]) for f in fields(Samples)}
    )
