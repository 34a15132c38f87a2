"""Charts, as matplotlib draws them."""

import numpy as np
import pytest
from matplotlib import image
from matplotlib import pyplot as plt

from pipelines.plotting.chart import Chart, Mark, Panel, Role, Series
from pipelines.plotting.matplotlib_charts import chart_figure, grid_figure
from pipelines.plotting.style import STYLE, save

X = np.linspace(0.0, 10.0, 50)


def chart(x_label="time, s", size=1.0):
    cloud = Series("", size * np.sin(X), Role.BEFORE, Mark.DOTS)
    mean = Series("running mean", size * np.cos(X), Role.AFTER, Mark.MEAN)
    panel = Panel("hip torque error, N·m", (cloud, mean), reach=2.0 * size)
    return Chart("key", "a title", "", x_label, X, (panel,))


@pytest.fixture(autouse=True)
def styled():
    with plt.rc_context(STYLE):
        yield
    plt.close("all")


@pytest.mark.parametrize(
    "figure",
    [
        lambda: chart_figure(chart()),
        lambda: grid_figure("a title", [[chart(), chart()], [chart(), chart()]]),
        lambda: plt.subplots(figsize=(4, 3))[0],
    ],
    ids=["chart", "grid", "without a layout"],
)
def test_a_saved_figure_ends_in_a_white_margin_on_all_sides(tmp_path, figure):
    save(figure(), tmp_path / "figure", ["png"])
    pixels = image.imread(tmp_path / "figure.png")[..., :3]
    for edge in (pixels[0], pixels[-1], pixels[:, 0], pixels[:, -1]):
        assert (edge == 1.0).all()


def test_charts_in_one_row_have_one_height_and_each_has_its_own_horizontal_axis():
    names = [["time, s", "angle, rad"], ["time, s", "angle, rad"]]
    grid = [
        [chart(name, size) for name in row] for row, size in zip(names, (1.0, 5.0), strict=True)
    ]
    axes = np.reshape(grid_figure("a title", grid).axes, (2, 2))
    assert [[axis.get_xlabel() for axis in row] for row in axes] == names
    assert [[axis.get_ylim() for axis in row] for row in axes] == [
        [(-2.0, 2.0)] * 2,
        [(-10.0, 10.0)] * 2,
    ]


def test_a_mean_bridges_rows_without_a_value_and_a_line_does_not():
    values = np.where(np.arange(len(X)) % 2, np.sin(X), np.nan)
    series = [Series(mark.name, values, Role.AFTER, mark) for mark in (Mark.MEAN, Mark.LINE)]
    figure = chart_figure(Chart("key", "a title", "", "x", X, (Panel("y", tuple(series)),)))
    mean, line = (one.get_ydata() for one in figure.axes[0].get_lines())
    assert not np.isnan(mean).any() and len(mean) == len(X) // 2
    np.testing.assert_array_equal(line, values)
