"""Numbers as text, with as many digits as their uncertainty justifies."""

from math import floor, isfinite, log10


def digits(value: float | None) -> str:
    """Return a number with three significant digits, a dash for none."""
    if value is None or not isfinite(value):
        return "–"
    return _written(value, _decimals(value, 3))


def digits_for(value: float, half: float | None) -> str:
    """Return a number to two digits of half its interval.

    Parameters
    ----------
    value : float
        The number.
    half : float or None
        Half-width of its interval; like ``digits`` without one.
    """
    if not half or not isfinite(half):
        return digits(value)
    return _written(value, _decimals(half, 2))


def _decimals(value: float, significant: int) -> int:
    return 0 if value == 0 else significant - 1 - floor(log10(abs(value)))


def _written(value: float, decimals: int) -> str:
    # Other magnitudes are written with a power of ten.
    if value != 0 and not 1e-4 <= abs(value) < 1e6:
        text = f"{value:.2e}"
    else:
        # round() also takes negative decimals, for 12346 to 12300; a format does not.
        text = f"{round(value, decimals):.{max(decimals, 0)}f}"
    if text.startswith("-"):
        # A typographic minus, and none before a number that was rounded to zero.
        return f"−{text[1:]}" if float(text) else text[1:]
    return text
