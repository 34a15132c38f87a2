"""``make faults``: cause every fault in a run, and write the results into docs/faults.md."""

import argparse
import re
import signal
from collections.abc import Iterator
from pathlib import Path
from tempfile import TemporaryDirectory

from pipelines.acquisition.recording.recover import recover
from pipelines.contracts import RECORDING
from pipelines.contracts.run_paths import journal_of
from tests.campaigns.faults.faults import Case, cases
from tests.campaigns.faults.process import fill_the_disk, send, strike
from tests.campaigns.faults.proxy import Frame, RtuFrame, TcpFrame
from tests.campaigns.faults.runs import run_through, wrong_rows

TABLE = """\
## Each fault
| line | fault | the run | samples missing | samples wrong | reason |
|---|---|---|---|---|---|
"""
"""The end of the page, which is measured; the text above it is written by hand."""


def rows() -> Iterator[str]:
    """Yield a line of the table for each fault."""
    for name, frames in (("TCP", TcpFrame), ("RTU", RtuFrame)):
        for case in cases(frames):
            with TemporaryDirectory() as folder:
                yield _row(name, frames, case, Path(folder))
    for name, blow in (
        ("Ctrl-C (SIGINT)", send(signal.SIGINT)),
        ("SIGTERM", send(signal.SIGTERM)),
        ("the disk is full", fill_the_disk),
        ("kill -9 (SIGKILL)", send(signal.SIGKILL)),
    ):
        with TemporaryDirectory() as folder:
            ended = strike(Path(folder), blow, rows=40)
            journal = journal_of(ended.output)
            if journal.exists():
                recovery = recover(journal)
                missing, wrong = recovery.summary.missed, _wrong(recovery.path, ended.latched)
                fate = (
                    "is killed, then `exoid recover`"
                    if ended.code < 0
                    else "stops, then `exoid recover`"
                )
                yield (
                    f"| TCP | {name} | {fate} | {missing} | {wrong} |"
                    f" {_plain(ended.error) or recovery.summary.abort} |\n"
                )
            else:
                kept = Path(folder) / "run.aborted.parquet"
                yield (
                    f"| TCP | {name} | stops | 0 | {_wrong(kept, ended.latched)} |"
                    f" {_plain(ended.error)} |\n"
                )


def _row(line: str, frames: type[Frame], case: Case, folder: Path) -> str:
    result = run_through(case.fault, folder, case.run, frames=frames)
    wrong = f"{result.wrong}, the last {result.wrong_s:g} s" if result.wrong else "0"
    fate = "goes on" if result.why is None else "stops"
    return (
        f"| {line} | {case.name} | {fate} | {result.missing} | {wrong} |"
        f" {_plain(result.why or '')} |\n"
    )


def _wrong(path: Path, latched: dict) -> int:
    return int(wrong_rows(RECORDING.read(path).frame, latched).sum())


def _plain(text: str) -> str:
    """Return a reason without what differs from run to run, and without what always follows it."""
    text = re.sub(r"127\.0\.0\.1:\d+", "127.0.0.1:502", text.removeprefix("exoid: "))
    text = re.sub(r"/\S*/(run\.(?:aborted\.)?parquet)", r"\1", text)
    return re.sub(r"; the leg was stopped.*", "", text)


def main() -> None:
    """Measure, and write the table in place of the old one."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("page", type=Path, nargs="?", default=Path("docs/faults.md"))
    page = parser.parse_args().page
    table = []
    for row in rows():
        print(row, end="", flush=True)
        table.append(row)
    by_hand, _, _ = page.read_text(encoding="utf-8").partition(TABLE.partition("\n")[0])
    page.write_text(by_hand + TABLE + "".join(table), encoding="utf-8")


main()
