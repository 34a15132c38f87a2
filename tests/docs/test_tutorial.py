"""Every command of docs/tutorial.md and docs/unsure.md runs, and prints the output shown there.

A ``console`` block is a session: ``$ exoid ...`` is run, what follows is what it prints, ``...``
stands for anything. A ``toml`` block that begins with ``# in FILE`` or ``# at the end of FILE`` is
an edit of that file.
"""

import re
import shlex
from collections.abc import Iterator
from dataclasses import dataclass
from pathlib import Path

import pytest

DOCS = Path(__file__).parents[2] / "docs"
PAGES = ("tutorial.md", "unsure.md")
BLOCK = re.compile(r"^```(console|toml)\n(.*?)^```", flags=re.MULTILINE | re.DOTALL)
NUMBER = re.compile(r"[-+]?\d[\d,]*\.?\d*(?:e[-+]?\d+)?")

SHORT = {
    "exoid.toml": {
        "iterations = 800 ": "iterations = 50 ",
        "base_frequency_hz = 0.1 ": "base_frequency_hz = 0.2 ",
        "duration_s = 40.0\n": "duration_s = 10.0\n",
        "\nsample_rate_hz = 200.0\n": "\nsample_rate_hz = 100.0\n",
        "figures = true": "figures = false",
        "sweep_nm_s_rad = [50.0, 100.0, 150.0, 200.0, 250.0, 300.0, 350.0, 400.0, 450.0, 500.0]": (
            "sweep_nm_s_rad = []"
        ),
    },
    "rigs/plain.toml": {"ramp_s = 3.0": "ramp_s = 1.0"},
}
"""Changes of the new experiment's files, so that it takes seconds and not minutes."""


@dataclass(frozen=True)
class Command:
    line: str
    printed: str


@dataclass(frozen=True)
class Edit:
    file: str
    at_the_end: bool
    text: str

    def make(self):
        path = Path(self.file)
        before = path.read_text(encoding="utf-8")
        if self.at_the_end:
            path.write_text(f"{before}\n{self.text}", encoding="utf-8")
            return
        for line in self.text.splitlines():
            key, equals, _ = line.partition(" = ")
            if equals:
                before, times = re.subn(
                    rf"^{re.escape(key)} = .*$", line, before, flags=re.MULTILINE
                )
                assert times == 1, f"{self.file} has {times} lines with {key}"
        path.write_text(before, encoding="utf-8")


def steps(page: str) -> Iterator[Command | Edit]:
    for kind, text in BLOCK.findall((DOCS / page).read_text(encoding="utf-8")):
        if kind == "toml":
            head, _, body = text.partition("\n")
            place = re.fullmatch(r"# (in|at the end of) (\S+)", head)
            assert place, f"a toml block of the tutorial lacks its file: {head}"
            yield Edit(place[2], place[1] != "in", body)
            continue
        for session in re.split(r"^\$ ", text, flags=re.MULTILINE)[1:]:
            line, _, printed = session.replace("\\\n", " ").partition("\n")
            yield Command(line, printed)


def do_all(page, exoid, monkeypatch, changes) -> Iterator[tuple[Command, str]]:
    """Do every step in the current folder; yield each command of exoid's with what it printed."""
    for step in steps(page):
        if isinstance(step, Edit):
            step.make()
            continue
        program, *arguments = shlex.split(step.line)
        if program == "cd":
            monkeypatch.chdir(Path(arguments[0]))
            continue
        assert program == "exoid", (
            f"the tutorial runs {program}, which a user on Windows may not have"
        )
        outcome = exoid(*arguments)
        assert outcome.code == 0, f"{step.line}: {outcome.err}"
        if arguments[0] == "init":
            shorten(Path(arguments[1]), changes)
        yield step, outcome.out


def shorten(folder, changes):
    for name, pairs in changes.items():
        text = (folder / name).read_text(encoding="utf-8")
        for old, new in pairs.items():
            assert old in text
            text = text.replace(old, new)
        (folder / name).write_text(text, encoding="utf-8")


GROUPS = ("rig", "settings")
"""Commands that have commands."""


@pytest.mark.parametrize("page", PAGES)
def test_the_commands_options_and_settings_of_a_page_exist(page, exoid, monkeypatch, tmp_path):
    monkeypatch.chdir(tmp_path)
    for step in steps(page):
        if isinstance(step, Edit):
            step.make()
            continue
        program, *words = shlex.split(step.line)
        if program == "cd":
            monkeypatch.chdir(Path(words[0]))
        elif words[0] == "init":
            assert exoid(*words).code == 0
        else:
            shown = exoid(*words[: 2 if words[0] in GROUPS else 1], "--help")
            assert shown.code == 0, shown.err
            options = [word for word in words if word.startswith("-")]
            assert [option for option in options if option not in shown.out] == [], step.line


@pytest.mark.slow
def test_every_command_of_the_tutorial_runs(exoid, monkeypatch, tmp_path):
    monkeypatch.chdir(tmp_path)
    done = dict(do_all("tutorial.md", exoid, monkeypatch, SHORT))
    (diagnosed,) = [out for step, out in done.items() if step.line == "exoid diagnose"]
    assert "parallel_spring at the knee" in diagnosed


@pytest.mark.slow
@pytest.mark.parametrize("page", PAGES)
def test_a_page_shows_the_output_of_its_commands(page, exoid, monkeypatch, tmp_path):
    monkeypatch.chdir(tmp_path)
    for step, out in do_all(page, exoid, monkeypatch, {}):
        assert alike(step.printed, out), f"{step.line} printed\n{out}"


def alike(wanted: str, printed: str) -> bool:
    """Compare words as they are, numbers to 5 % and blanks not at all; ``...`` in the page stands
    for anything."""
    numbers = [
        value(number) for word in wanted.split() if word != "..." for number in NUMBER.findall(word)
    ]
    pattern = r"\s*".join(r".*?" if word == "..." else pattern_of(word) for word in wanted.split())
    match = re.fullmatch(pattern, printed.strip(), flags=re.DOTALL)
    return match is not None and all(
        abs(value(x) - number) <= 0.05 * abs(number) + 0.02
        for x, number in zip(match.groups(), numbers, strict=True)
    )


def pattern_of(word: str) -> str:
    return f"({NUMBER.pattern})".join(re.escape(text) for text in NUMBER.split(word))


def value(number: str) -> float:
    return float(number.replace(",", ""))


def test_a_page_with_another_number_or_word_is_not_alike():
    assert alike("rms ... 2.95 N·m,\n  done", "rms  of 4 runs 3.01 N·m, done\n")
    assert not alike("rms 2.95 N·m", "rms 3.95 N·m")
    assert not alike("rms 2.95 N·m", "rms 2.95 N")
    assert not alike("rms 2.95 N·m", "rms 2.95 N·m and more")
