"""The scripts of docs/examples run as they stand and find what they say; the notebook runs with the
site."""

import runpy
from pathlib import Path

import pytest

EXAMPLES = Path(__file__).parents[2] / "docs" / "examples"
DIAGNOSING = {"hide_and_find"}


@pytest.mark.parametrize(
    "script",
    [
        pytest.param(path, marks=pytest.mark.slow if path.stem in DIAGNOSING else [])
        for path in sorted(EXAMPLES.glob("*.py"))
    ],
    ids=lambda path: path.stem,
)
def test_an_example_shows_what_it_says(script, capsys):
    runpy.run_path(str(script), run_name="__main__")
    assert capsys.readouterr().out.strip()


def test_every_example_is_listed():
    listed = (EXAMPLES / "README.md").read_text(encoding="utf-8")
    for path in [*EXAMPLES.glob("*.py"), *EXAMPLES.glob("*.ipynb")]:
        assert f"({path.name})" in listed
