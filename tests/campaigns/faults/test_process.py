"""What befalls the computer: signals, a full disk, and a kill at any moment."""

import re
import signal

import numpy as np
import pytest

from pipelines.acquisition.recording.recover import recover
from pipelines.contracts import RECORDING
from pipelines.contracts.run_paths import journal_of
from tests.campaigns.faults.process import fill_the_disk, send, strike
from tests.campaigns.faults.runs import wrong_rows

LONGEST_LOSS_S = 0.5


@pytest.mark.parametrize(
    ("number", "name"),
    [
        pytest.param(signal.SIGINT, "Ctrl-C", marks=pytest.mark.slow),
        (signal.SIGTERM, "SIGTERM"),
    ],
)
def test_a_signal_ends_the_run_with_all_that_was_exchanged(tmp_path, number, name):
    ended = strike(tmp_path, send(number), rows=40)
    table = RECORDING.read(tmp_path / "run.aborted.parquet")
    assert (ended.code, ended.disabled) == (3, True)
    assert table.metadata["abort"] == f"stopped by {name}"
    assert not wrong_rows(table.frame, ended.latched).any()
    assert table.metadata["gaps"] == []


def test_a_full_disk_ends_the_run_and_what_was_written_before_is_recovered(tmp_path):
    ended = strike(tmp_path, fill_the_disk, rows=40)
    assert (ended.code, ended.disabled) == (3, True)
    assert len(ended.error.splitlines()) == 1
    assert re.search(
        r"run.parquet.journal: cannot be written .*make room, then `exoid recover ", ended.error
    )
    recovery = recover(journal_of(ended.output))
    frame = RECORDING.read(recovery.path).frame
    assert recovery.summary.samples >= 40
    assert not wrong_rows(frame, ended.latched).any()
    assert (np.diff(frame["sequence"]) == 1).all()


def kill_and_compare(folder, generator):
    """Kill a run at some moment; nothing that was exchanged half a second before may be lost."""
    ended = strike(
        folder,
        send(signal.SIGKILL),
        rows=int(generator.integers(1, 60)),
        wait_s=generator.uniform(0.0, 1.0),
    )
    recovery = recover(journal_of(ended.output))
    frame = RECORDING.read(recovery.path).frame
    assert not wrong_rows(frame, ended.latched).any()
    assert (np.diff(frame["sequence"]) == 1).all()
    last = int(frame["sequence"].iloc[-1])
    # The next sample was fetched, at the earliest, when it was latched.
    after = ended.latched.get(last + 1)
    return 0.0 if after is None else ended.struck_at - after.at


@pytest.mark.parametrize("seed", [0, pytest.param(1, marks=pytest.mark.slow)])
def test_a_killed_run_is_recovered_but_for_its_last_half_second(tmp_path, seed):
    assert kill_and_compare(tmp_path, np.random.default_rng(seed)) < LONGEST_LOSS_S


@pytest.mark.slow
def test_a_run_killed_a_hundred_times_never_loses_more_than_half_a_second(tmp_path):
    generator = np.random.default_rng(2026)
    lost = [kill_and_compare(tmp_path / str(k), generator) for k in range(100)]
    print(f"\nlost: at most {max(lost):.3f} s, in the mean {np.mean(lost):.3f} s")
    assert max(lost) < LONGEST_LOSS_S
