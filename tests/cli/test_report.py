"""`exoid report` and `exoid figures` as a user calls them."""

import json

import pytest
from matplotlib.pyplot import imread

from tests.report.sessions import write_parameters, write_session


@pytest.fixture
def folder(tmp_path):
    return write_session(tmp_path / "demo")


def test_the_page_is_written_and_its_summary_said(exoid, folder, tmp_path):
    outcome = exoid("report", folder, "-o", tmp_path / "page.html")
    assert outcome.code == 0
    assert outcome.out.startswith("Missing from the simulation: cogging at the knee")
    assert (tmp_path / "page.html").read_text().startswith("<!doctype html>")


def test_in_a_folder_with_results_no_arguments_are_needed(exoid, folder, monkeypatch):
    monkeypatch.chdir(folder)
    document = json.loads(exoid("report", "--json").out)
    assert document["path"] == "report.html"
    assert document["bytes"] == len((folder / "report.html").read_bytes())


def test_two_sessions_are_compared(exoid, folder, tmp_path):
    other = write_session(tmp_path / "other", shift=0.06)
    outcome = exoid("report", "--compare", folder, other, "-o", tmp_path / "compared.html")
    assert outcome.out.startswith("5 of 5 parameters changed beyond their intervals (95 %).\n")
    assert "demo and other" in (tmp_path / "compared.html").read_text()


def test_figures_are_written_as_pdf_and_png_whole(exoid, folder, tmp_path):
    names = ("error-budget", "verdict", "kv-sweep")
    outcome = exoid(
        "figures",
        folder,
        "-o",
        tmp_path / "figures",
        *(word for name in names for word in ("--only", name)),
    )
    assert outcome.code == 0
    for name in names:
        assert (tmp_path / "figures" / f"{name}.pdf").read_bytes().startswith(b"%PDF")
        picture = imread(tmp_path / "figures" / f"{name}.png")[..., :3]
        assert picture.shape[0] > 300 and picture.shape[1] > 600  # 200 dpi
        # Nothing is cut off: what is drawn stands within a white edge.
        assert all(
            (edge == 1).all() for edge in (picture[0], picture[-1], picture[:, 0], picture[:, -1])
        )
        assert (picture < 1).any()


def test_a_mistyped_figure_gets_a_suggestion(exoid, folder):
    outcome = exoid("figures", folder, "--only", "error-bugdet")
    assert (outcome.code, outcome.err) == (
        2,
        "exoid: --only error-bugdet: there is no such figure here; did you mean error-budget?\n",
    )


@pytest.mark.parametrize(
    ("arguments", "says"),
    [
        (
            ["nowhere"],
            (
                "nowhere: no such folder, expected an experiment's folder; name the one that its"
                " stages wrote to"
            ),
        ),
        (
            ["demo", "-o", "demo"],
            "-o demo: is a folder, expected the name of a page; write demo/report.html",
        ),
        (
            ["demo", "--compare", "demo", "demo"],
            "--compare names both its folders itself; drop the others, or --compare",
        ),
    ],
)
def test_what_cannot_be_is_refused_in_a_line(exoid, folder, monkeypatch, arguments, says):
    monkeypatch.chdir(folder.parent)
    outcome = exoid("report", *arguments)
    assert (outcome.code, " ".join(outcome.err.split())) == (2, f"exoid: {says}")


def test_where_there_is_nothing_to_draw_that_is_said(exoid, tmp_path):
    write_parameters(tmp_path)
    outcome = exoid("figures", tmp_path)
    assert outcome.code == 2
    assert "holds nothing to draw; `exoid diagnose` and `exoid simulate` make it" in " ".join(
        outcome.err.split()
    )


@pytest.mark.parametrize("text", ['{"contract": "verdict/1", "sta', '{"contract": "verdict/1"}'])
def test_a_damaged_verdict_is_named_on_the_terminal_and_on_the_page_and_the_rest_is_shown(
    exoid, folder, tmp_path, text
):
    (folder / "diagnosed" / "verdict.json").write_text(text)
    outcome = exoid("report", folder, "-o", tmp_path / "page.html")
    assert outcome.code == 0
    assert f"warning: {folder / 'diagnosed' / 'verdict.json'}: " in outcome.err
    page = (tmp_path / "page.html").read_text(encoding="utf-8")
    top = page[page.index('<section id="verdict"') : page.index('<section id="measured"')]
    assert "The verdict cannot be read" in top
    assert "diagnosed/verdict.json: " in top
    assert "Not diagnosed yet" not in page
    assert "torque-with_human_validate-knee" in page
    outcome = exoid("figures", folder, "-o", tmp_path / "figures", "--only", "kv-sweep")
    assert outcome.code == 0
    assert "verdict.json: " in outcome.err
