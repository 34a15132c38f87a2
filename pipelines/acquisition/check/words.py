"""Whether the words of long values are in the right order, and of one sample."""

from collections.abc import Iterator

import numpy as np
from numpy.typing import NDArray

from pipelines.acquisition.check.finding import Finding
from pipelines.acquisition.check.probe import Probe, Series
from pipelines.acquisition.machine.torn_words import NEAR, is_leap
from pipelines.settings.rig import Register


def check_words(probe: Probe, series: Series, *, order: bool) -> Iterator[Finding]:
    """Yield findings about integers of several words that leap from reading to reading.

    No limits are needed: what a machine measures changes little from one sample to the next, and
    words in another order make a small change a large one.

    Parameters
    ----------
    probe : Probe
    series : Series
        Repeated readings of its block.
    order : bool
        Whether to check the order, too. The limits of a drive show a wrong one by themselves.
    """
    for name, register in series.block.registers.items():
        if name in ("sequence", "time") or register.registers == 1 or register.counts is None:
            continue
        where = f"{probe.map_path}.read.{name}"
        other = "big" if register.word_order == "little" else "little"
        steps = _steps(series, name, register)
        turned = register.model_copy(update={"word_order": other})
        sizes, sizes_turned = np.abs(steps), np.abs(_steps(series, name, turned))
        if order and _is_turned(series, name, sizes, sizes_turned):
            yield Finding(
                probe.name,
                f"{name} changes by up to {sizes.max():.0f} counts from one reading to the next,"
                f' and with word_order = "{other}" by {sizes_turned.max():.0f}: correct {where},'
                " or its address",
                name,
                is_explained=True,
            )
        elif _is_torn(steps / register.word):
            yield probe.finding(
                f"{name} leaps by {register.word} counts and back: its words are of two instants;"
                f" read a value that the device latches, or one of a single register, as {where}",
                name,
            )


def _is_turned(series: Series, name: str, sizes: NDArray, sizes_turned: NDArray) -> bool:
    """Return whether the other order of words gives far smaller changes, and no accident does."""
    enough = 5  # changes
    # Halfway, in powers of two, between the same changes and those of a high word for a low one.
    ratio = 256.0
    low = series.raw(name)[:, 0 if series.block.registers[name].word_order == "little" else -1]
    # A value whose low word is constant may be in either order: as of an encoder of 16 bits that
    # fills the high word.
    return bool(
        np.count_nonzero(sizes) >= enough
        and np.ptp(low)
        and ratio * sizes_turned.sum() < sizes.sum()
    )


def _is_torn(steps: NDArray) -> bool:
    """Return whether changes (n,), in high words, hold a leap of one that is taken back at once."""
    leaps = np.array([is_leap(step) for step in steps], dtype=bool)
    back = leaps[:-1] & leaps[1:] & (steps[:-1] * steps[1:] < 0.0)
    return bool(back.any() and (np.abs(steps[~leaps]) <= NEAR).all())


def _steps(series: Series, name: str, register: Register) -> NDArray:
    """Return the changes of a value that are not zero, counts, (k,).

    Without any, return one of zero, so that there is a largest one.
    """
    raw = register.model_copy(update={"scale": 1.0, "offset": 0.0, "unit": "1"})
    steps = np.diff(series.of(name, raw)[series.fresh])
    return steps[steps != 0.0] if steps.any() else np.zeros(1)
