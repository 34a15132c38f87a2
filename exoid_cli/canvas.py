"""Lines on a terminal: a raster of square dots, eight of them in a braille character."""

import numpy as np
from numpy.typing import NDArray

BLANK = 0x2800
DOTS = np.array([[0x01, 0x08], [0x02, 0x10], [0x04, 0x20], [0x40, 0x80]])
"""Bit of each of a character's dots, four rows of two (Unicode 16, braille patterns)."""


class Canvas:
    """A raster of ``rows`` x ``columns`` characters."""

    def __init__(self, columns: int, rows: int) -> None:
        self.dots: NDArray = np.zeros((4 * rows, 2 * columns), dtype=bool)

    @property
    def size(self) -> tuple[int, int]:
        """Width and height in dots."""
        return self.dots.shape[1], self.dots.shape[0]

    def line(self, start: NDArray, stop: NDArray, thickness: int = 1, every: int = 1) -> None:
        """Draw from one place (x to the right, y down, in dots) to another; every n-th dot of it,
        where asked for."""
        steps = int(np.ceil(2 * np.max(np.abs(stop - start)))) + 1
        path = (start + np.linspace(0.0, 1.0, steps)[:, np.newaxis] * (stop - start))[:: 2 * every]
        pen = np.arange(thickness) - (thickness - 1) / 2
        places = path[:, np.newaxis, np.newaxis] + np.stack(np.meshgrid(pen, pen), axis=-1)
        x, y = np.round(places.reshape(-1, 2)).astype(int).T
        inside = (x >= 0) & (x < self.size[0]) & (y >= 0) & (y < self.size[1])
        self.dots[y[inside], x[inside]] = True

    def text(self) -> list[str]:
        """Return the picture, a string a row."""
        rows, columns = self.dots.shape[0] // 4, self.dots.shape[1] // 2
        codes = np.einsum("rick,ik->rc", self.dots.reshape(rows, 4, columns, 2), DOTS) + BLANK
        # A space where no dot is: some fonts show the dots that are not set.
        return ["".join(map(chr, row)).replace(chr(BLANK), " ") for row in codes.tolist()]
