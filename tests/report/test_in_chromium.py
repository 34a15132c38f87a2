"""The page in a real browser, opened from its file, without a network."""

import numpy as np
import pytest

from pipelines.contracts import RESIDUALS, SIMULATION, Joint
from pipelines.report.html.report import report
from pipelines.report.session import find
from tests.report.sessions import (
    AXIS,
    write_parameters,
    write_recording,
    write_replay,
    write_residuals,
    write_session,
    write_verdict,
)

pytestmark = pytest.mark.long

DRAWN = """key => exoid.plots.get(key).map(u => {
    const all = u.ctx.getImageData(0, 0, u.ctx.canvas.width, u.ctx.canvas.height).data;
    const colours = new Set();
    for (let i = 0; i < all.length; i += 4)
        if (all[i + 3]) colours.add((all[i] << 16) | (all[i + 1] << 8) | all[i + 2]);
    return colours.size;
})"""
RANGE = "key => { const s = exoid.plots.get(key)[0].scales.x; return [s.min, s.max]; }"


def draw_all(page):
    page.evaluate("exoid.drawAll()")
    page.wait_for_function("[...exoid.plots.values()].flat().every(u => u.status === 1)")


@pytest.mark.parametrize("scheme", ["light", pytest.param("dark", marks=pytest.mark.slow)])
def test_the_page_loads_without_a_complaint_and_every_chart_is_drawn(opened, page_file, scheme):
    with opened(page_file, color_scheme=scheme) as page:
        draw_all(page)
        keys = page.evaluate("Object.keys(exoid.data.charts)")
        assert len(keys) > 10
        for key in keys:
            assert all(colours > 5 for colours in page.evaluate(DRAWN, key)), key


def test_dragging_zooms_every_chart_of_the_run_and_a_double_click_shows_all_again(
    opened, page_file
):
    with opened(page_file) as page:
        draw_all(page)
        first, second = "torque-with_human_validate-hip", "angle-with_human_validate-knee"
        whole = page.evaluate(RANGE, first)
        over = page.locator(f'[data-chart="{first}"] .u-over').first
        over.scroll_into_view_if_needed()
        box = over.bounding_box()
        page.mouse.move(box["x"] + 0.25 * box["width"], box["y"] + 60)
        page.mouse.down()
        page.mouse.move(box["x"] + 0.5 * box["width"], box["y"] + 60, steps=5)
        page.mouse.up()
        span = whole[1] - whole[0]
        for key in (first, second):
            low, high = page.evaluate(RANGE, key)
            assert low == pytest.approx(whole[0] + 0.25 * span, abs=0.02 * span)
            assert high == pytest.approx(whole[0] + 0.5 * span, abs=0.02 * span)
        over.dblclick()
        assert page.evaluate(RANGE, first) == pytest.approx(whole)


def test_buttons_zoom_without_a_mouse(opened, page_file):
    with opened(page_file) as page:
        draw_all(page)
        key = "torque-with_human_validate-hip"
        whole = page.evaluate(RANGE, key)
        tools = page.locator("[data-zoom='with_human_validate.parquet']")
        tools.get_by_role("button", name="show less").press("Enter")
        low, high = page.evaluate(RANGE, key)
        assert high - low == pytest.approx((whole[1] - whole[0]) / 2)
        tools.get_by_role("button", name="show the whole run").press("Enter")
        assert page.evaluate(RANGE, key) == pytest.approx(whole)


@pytest.mark.parametrize(
    "width",
    [360, 1920, *(pytest.param(width, marks=pytest.mark.slow) for width in (390, 768, 1280))],
)
def test_nothing_sticks_out_of_the_screen(opened, page_file, width):
    with opened(page_file, width=width) as page:
        draw_all(page)
        assert page.evaluate("document.documentElement.scrollWidth") <= width


def test_the_verdict_stands_on_the_first_screen(opened, page_file):
    with opened(page_file, width=1280, height=860) as page:
        for text in (
            "The simulation misses cogging or parallel spring at the knee",
            "Missing from the simulation",
            "Is anything missing?",
            "cannot separate",
            "repeats with the motion",
            "× floor",
        ):
            assert page.get_by_text(text).first.bounding_box()["y"] < 860


def test_a_printed_page_shows_every_chart_on_white(opened, page_file):
    with opened(page_file, color_scheme="dark") as page:
        page.evaluate("dispatchEvent(new Event('beforeprint'))")
        page.wait_for_function("exoid.plots.size === Object.keys(exoid.data.charts).length")
        assert page.evaluate("[...document.querySelectorAll('details')].every(d => d.open)")
        paper = page.evaluate(
            "getComputedStyle(document.documentElement).getPropertyValue('--paper')"
        )
        assert paper.strip() == "#ffffff"
        page.wait_for_function("[...exoid.plots.values()].flat().every(u => u.status === 1)")
        for key in page.evaluate("Object.keys(exoid.data.charts)"):
            assert all(colours > 5 for colours in page.evaluate(DRAWN, key)), key
        page.evaluate("dispatchEvent(new Event('afterprint'))")
        assert page.evaluate("document.documentElement.dataset.theme") is None
        assert page.evaluate("[...exoid.plots.values()].flat().every(u => u.height === u.onScreen)")
        assert len(page.pdf(format="A4")) > 50_000


def test_the_leg_moves(opened, page_file):
    picture = "document.querySelector('[data-stage] canvas').toDataURL()"
    with opened(page_file) as page:
        stage = page.locator("[data-stage]").first
        stage.scroll_into_view_if_needed()
        before = page.evaluate(picture)
        stage.get_by_role("button", name="Play").click()
        page.wait_for_timeout(400)
        stage.get_by_role("button", name="Pause").click()
        assert page.evaluate(picture) != before
        assert float(stage.locator("output").inner_text().split()[0]) > 0.1


ROOM = """() => {
    const c = document.querySelector('[data-stage] canvas');
    const copy = document.createElement('canvas');
    Object.assign(copy, { width: c.width, height: c.height });
    copy.getContext('2d', { willReadFrequently: true }).drawImage(c, 0, 0);
    const all = copy.getContext('2d').getImageData(0, 0, c.width, c.height).data;
    let [left, right, top, bottom] = [c.width, 0, c.height, 0];
    for (let i = 0; i < all.length / 4; i++) if (all[4 * i + 3]) {
        const x = i % c.width, y = Math.floor(i / c.width);
        [left, right] = [Math.min(left, x), Math.max(right, x)];
        [top, bottom] = [Math.min(top, y), Math.max(bottom, y)];
    }
    return [left, c.width - 1 - right, top, c.height - 1 - bottom];
}"""
"""Pixels left free on each side of the machine."""


def test_a_pendulum_that_swings_up_stays_in_the_picture(opened, tmp_path):
    joints = (Joint("joint"),)
    recording, model = write_recording(tmp_path, joints), write_parameters(tmp_path, joints)
    path = write_replay(tmp_path, model, recording, joints)
    table = SIMULATION.read(path)
    for column in ("joint_reference_rad", "joint_angle_rad"):
        table.frame[column] = table.frame[column] / 0.4 * np.pi
    SIMULATION.write(path, table.frame, table.metadata)
    page_file = tmp_path / "report.html"
    page_file.write_text(report(find([tmp_path])), encoding="utf-8")
    with opened(page_file) as page:
        stage = page.locator("[data-stage]").first
        stage.scroll_into_view_if_needed()
        for part in range(0, 1000, 100):
            stage.locator("input").evaluate(
                "(e, k) => { e.value = k; e.dispatchEvent(new Event('input')); }", part
            )
            assert min(page.evaluate(ROOM)) > 2


def test_an_exaggerated_difference_is_said_on_the_picture(opened, page_file):
    with opened(page_file) as page:
        stage = page.locator("[data-stage]").first
        stage.scroll_into_view_if_needed()
        assert stage.locator("select").input_value() == "1"
        page.evaluate("""() => {
                const stage = document.querySelector('[data-stage] canvas').getContext('2d');
                stage.fillText = text => { window.said = text; };
            }""")
        stage.locator("select").select_option("5")
        assert page.evaluate("window.said") == "difference from measured drawn × 5"


EVIL = "</script><script>alert('broken in')</script><img src=x onerror=alert(1)>\"'{{7*7}}"


def test_text_from_a_hostile_file_is_shown_and_never_run(opened, tmp_path):
    folder = write_session(tmp_path / "<b>leg", rig=EVIL, subject=EVIL, session=EVIL, abort=EVIL)
    write_verdict(folder, summary=EVIL, caveats=[EVIL], status=EVIL)
    page_file = tmp_path / "report.html"
    page_file.write_text(report(find([folder]), title=EVIL), encoding="utf-8")
    with opened(page_file) as page:
        draw_all(page)
        assert page.title().startswith(EVIL)
        assert page.locator(".lead").inner_text() == EVIL
        assert page.locator("img").count() == 0
        assert page.locator("script").count() == 5


def test_even_a_script_that_got_in_would_not_run(opened, chromium, page_file, tmp_path):
    broken = tmp_path / "broken.html"
    text = page_file.read_text(encoding="utf-8")
    broken.write_text(
        text.replace("</main>", "<script>document.title = 'broken in'</script></main>"),
        encoding="utf-8",
    )
    page = chromium.new_page()
    page.goto(broken.as_uri())
    assert page.title() != "broken in"
    page.close()


def test_a_million_samples_stay_fluid_and_a_spike_among_them_is_seen(opened, tmp_path):
    recording = write_recording(tmp_path, AXIS)
    baseline, extended = (
        write_parameters(tmp_path, AXIS, extended=which) for which in (False, True)
    )
    write_residuals(tmp_path, AXIS, seconds=1000.0)
    write_verdict(tmp_path, AXIS)
    for parameters in (baseline, extended):
        write_replay(
            tmp_path, parameters, recording, AXIS, seconds=1000.0, rate_hz=1000.0, spike=654_321
        )
    text = report(find([tmp_path]))
    assert len(text.encode()) < 5_000_000
    page_file = tmp_path / "report.html"
    page_file.write_text(text, encoding="utf-8")
    with opened(page_file) as page:
        draw_all(page)
        key = "angle-with_human_validate-axis"
        assert "1,000,000 rows" in page.locator(f'[data-chart="{key}"] figcaption').inner_text()
        at = page.evaluate(
            "k => { const u = exoid.plots.get(k)[1], y = u.data[1];"
            "return u.data[0][y.indexOf(Math.max(...y.filter(v => v !== null)))]; }",
            key,
        )
        assert at == pytest.approx(654.321)
        # Median of zooms to ever other places, all charts of the run together, drawing included.
        took = page.evaluate(
            """async key => {
                const u = exoid.plots.get(key)[0], times = [];
                for (let k = 0; k < 15; k++) {
                    const begin = performance.now();
                    u.setScale('x', { min: 40 * k, max: 40 * k + 300 });
                    await Promise.resolve();
                    times.push(performance.now() - begin);
                }
                return times.sort((a, b) => a - b)[7];
            }""",
            key,
        )
        assert took < 200


def test_charts_of_a_run_keep_one_time_axis_where_one_of_them_has_nothing_to_show(opened, tmp_path):
    folder = write_session(tmp_path / "leg")
    path = folder / "diagnosed" / "residuals.parquet"
    table = RESIDUALS.read(path)
    table.frame.loc[table.frame["time_s"].between(5.0, 15.0), "scored"] = False
    RESIDUALS.write(path, table.frame, table.metadata)
    page_file = tmp_path / "report.html"
    page_file.write_text(report(find([folder])), encoding="utf-8")
    shape = (
        "k => exoid.plots.get(k).map(u => [u.bbox.left, u.bbox.width, u.scales.y.min,"
        " u.scales.y.max])"
    )
    with opened(page_file) as page:
        draw_all(page)
        key = "torque-with_human_validate-hip"
        whole = page.evaluate(shape, key)
        page.evaluate("k => exoid.plots.get(k)[0].setScale('x', { min: 7, max: 12 })", key)
        zoomed = page.evaluate(shape, key)
        assert page.evaluate(RANGE, key) == [7, 12]
        assert [panel[:2] for panel in zoomed] == [panel[:2] for panel in whole]
        assert zoomed[1] == whole[1]  # nothing to show: as it was


PRINTED = """async () => {
    dispatchEvent(new Event('beforeprint'));
    // Plots take their size then, and no observer is asked yet.
    for (let k = 0; k < 5; k++) await Promise.resolve();
    const ctx = document.createElement('canvas').getContext('2d');
    ctx.font = '12px system-ui, sans-serif';
    const told = { wide: document.documentElement.scrollWidth, texts: [], gaps: [] };
    for (const figure of document.querySelectorAll('[data-chart]')) {
        const u = exoid.plots.get(figure.dataset.chart).at(-1), axis = u.axes[0];
        told.texts.push(12 * figure.querySelector('.plot').clientWidth / u.width);
        const labels = axis._values.map((text, i) => {
            const half = ctx.measureText(text).width / 2, at = u.valToPos(axis._splits[i], 'x');
            return text ? [at - half, at + half] : null;
        }).filter(Boolean);
        labels.slice(1).forEach((label, i) => told.gaps.push(label[0] - labels[i][1]));
    }
    return told;
}"""
"""As a browser lays a page out for paper: how wide it is, how large its charts' letters get and how
far apart, px."""


@pytest.mark.parametrize("paper", [695, pytest.param(718, marks=pytest.mark.slow)])
def test_on_paper_nothing_sticks_out_and_no_axis_outgrows_the_text_or_has_labels_that_meet(
    opened, tmp_path, paper
):
    folder = write_session(tmp_path / "leg")
    path = folder / "diagnosed" / "residuals.parquet"
    table = RESIDUALS.read(path)
    # Ticks of three decimals.
    table.frame["knee_angle_rad"] *= 0.126 / table.frame["knee_angle_rad"].abs().max()
    RESIDUALS.write(path, table.frame, table.metadata)
    page_file = tmp_path / "report.html"
    page_file.write_text(report(find([folder])), encoding="utf-8")
    with opened(page_file, width=1280) as page:
        draw_all(page)
        from_screen = page.evaluate(PRINTED)["gaps"]
        page.emulate_media(media="print")
        page.set_viewport_size({"width": paper, "height": 900})
        printed = page.evaluate(PRINTED)
        body, cell = (
            page.evaluate(f"parseFloat(getComputedStyle({of}).fontSize)")
            for of in ("document.body", "document.querySelector('table.scores td')")
        )
        assert printed["wide"] <= paper
        assert max(printed["texts"]) <= body
        assert min(from_screen + printed["gaps"]) > 4
        assert cell == pytest.approx(8 * 96 / 72, abs=0.1)
