"""A journal that is damaged anywhere, in any way a disk damages a file, never gives wrong numbers
for right ones."""

from types import SimpleNamespace

import numpy as np
import pytest

from pipelines.acquisition.modbus.file_lock import locked
from pipelines.acquisition.recording.journal import Journal
from pipelines.acquisition.recording.journal_file import JournalFile, refuse_leftover
from pipelines.acquisition.recording.recording import recording_path
from pipelines.acquisition.recording.recover import recover
from pipelines.acquisition.run_outcome import finish_run, record_journal
from pipelines.contracts import RECORDING
from pipelines.contracts.run_paths import journal_of
from pipelines.errors import DeviceError, InputError
from tests.acquisition.recording.test_recover import COLUMNS, METADATA

SAMPLES, BATCH = 160, 20
SECTOR = 512
VALUES = np.random.default_rng(11).normal(size=(SAMPLES, 4))
"""Of the columns between time and counter: none can be guessed from its neighbours."""


def row(index):
    return [index / 200.0, *VALUES[index], 7000 + index]


class Written:
    """A journal's bytes, and where each of its batches of samples begins and ends."""

    def __init__(self, folder, *, ended, run="exo_alone", why=None):
        self.path = journal_of(folder / "one.parquet")
        self.places = []
        journal = Journal(self.path, COLUMNS, METADATA | {"run": run, "subject": "x" * 2000})
        for index in range(SAMPLES):
            journal.append(row(index))
            if index % BATCH == BATCH - 1:
                begin = journal._file.tell()
                journal.flush()
                self.places.append((begin, journal._file.tell()))
        if ended:
            journal.end(why)
            journal.close()
        else:
            journal._file.close()  # as the system does for a process that is no more
        self.bytes = self.path.read_bytes()

    def untouched(self, begin, end):
        """Return the samples of all batches outside of some bytes."""
        kept = [k for k, place in enumerate(self.places) if place[1] <= begin or place[0] >= end]
        return {BATCH * k + i for k in kept for i in range(BATCH)}

    def recovered(self, damaged, output):
        """Recover a damaged journal; return its samples' numbers after it was found that no value
        is wrong."""
        self.path.write_bytes(damaged)
        try:
            recovery = recover(self.path, output)
        except InputError as error:  # nothing is recovered, nothing lost, and both are reported
            assert str(error).startswith(f"{self.path}: ")
            assert "delete" not in str(error)
            assert self.path.read_bytes() == damaged
            return set()
        frame = RECORDING.read(output).frame
        output.unlink()
        numbers = frame["sequence"].to_numpy() - 7000
        assert np.array_equal(frame[COLUMNS].to_numpy(), [row(k) for k in numbers])
        summary = recovery.summary
        assert (
            len(numbers)
            == summary.samples
            == SAMPLES - summary.missed - (summary.cut_off - (200 - SAMPLES))
        )
        if summary.damaged:
            assert self.path.read_bytes() == damaged
        else:
            assert not self.path.exists()
            assert len(numbers) == SAMPLES
        return set(numbers)


@pytest.fixture(params=[False, True], ids=["killed", "ended"])
def written(request, tmp_path):
    return Written(tmp_path, ended=request.param)


def spoil(whole, rng, how, begin, end, stale):
    """Return a file of which the bytes between two places are damaged."""
    lost = {
        "zeroed": lambda: bytes(end - begin),
        "erased": lambda: b"\xff" * (end - begin),
        "random": lambda: rng.bytes(end - begin),
        "left out": lambda: b"",
        "twice": lambda: 2 * whole[begin:end],
        "stale": lambda: stale[begin:end],
        "inserted": lambda: rng.bytes(end - begin) + whole[begin:end],
        "flipped": lambda: bytes([whole[begin] ^ 1 << rng.integers(8)]) + whole[begin + 1 : end],
    }
    return whole[:begin] + lost[how]() + whole[end:]


HOW = ("zeroed", "erased", "random", "left out", "twice", "stale", "inserted", "flipped")


@pytest.mark.parametrize("how", HOW)
def test_each_row_that_is_recovered_was_recorded_and_the_rest_is_reported_for_any_damaged_sector(
    written, tmp_path, how
):
    (tmp_path / "other").mkdir()
    stale = Written(tmp_path / "other", ended=True, run="with_human").bytes
    rng = np.random.default_rng(5)
    for begin in range(0, len(written.bytes), SECTOR):
        end = min(begin + SECTOR, len(written.bytes))
        damaged = spoil(written.bytes, rng, how, begin, end, stale)
        numbers = written.recovered(damaged, tmp_path / "made.parquet")
        assert written.untouched(begin, end) <= numbers, (how, begin)


def test_each_row_that_is_recovered_was_recorded_and_the_rest_is_reported_for_any_damaged_bytes(
    written, tmp_path
):
    (tmp_path / "other").mkdir()
    stale = Written(tmp_path / "other", ended=True, run="with_human").bytes
    rng = np.random.default_rng(6)
    for _ in range(200):
        begin = int(rng.integers(len(written.bytes)))
        end = min(begin + int(2 ** rng.uniform(0, 11)), len(written.bytes))
        damaged = spoil(written.bytes, rng, rng.choice(HOW), begin, end, stale)
        assert written.untouched(begin, end) <= written.recovered(
            damaged, tmp_path / "made.parquet"
        )


def flipped(whole, at, bit):
    return whole[:at] + bytes([whole[at] ^ 1 << bit]) + whole[at + 1 :]


def test_a_flipped_bit_of_a_batch_is_never_taken_for_a_number_and_costs_no_other_batch(
    written, tmp_path
):
    begin, end = written.places[3]
    for at in range(begin, end, 7):
        numbers = written.recovered(flipped(written.bytes, at, at % 8), tmp_path / "made.parquet")
        assert numbers == written.untouched(begin, end), at


def test_no_batch_is_read_by_a_head_that_it_was_not_written_after(written, tmp_path):
    lost = written.bytes.replace(b"exoid-head:", b"other-head:")
    assert written.recovered(lost, tmp_path / "made.parquet") == set(range(SAMPLES))
    for at in range(0, written.bytes.index(b"exoid-head:") - 1000, 13):
        assert written.recovered(flipped(lost, at, at % 8), tmp_path / "made.parquet") == set()


def test_a_journal_of_which_nothing_can_be_read_is_not_reported_as_of_no_use(written):
    begin, end = written.places[0][0], written.places[-1][1]
    written.path.write_bytes(written.bytes[:begin] + bytes(end - begin) + written.bytes[end:])
    with pytest.raises(InputError) as refused:
        recover(written.path)
    assert (
        str(refused.value)
        == f"{written.path}: no sample in it can be read, it is damaged; keep it, and check the"
        " disk"
    )
    with pytest.raises(InputError, match=r"holds 0 samples .* or move it away, it is damaged"):
        refuse_leftover(written.path)


@pytest.mark.parametrize("why", ["stopped by Ctrl-C; the leg was stopped", None])
@pytest.mark.parametrize("lost", [3, 8])
def test_a_run_whose_journal_the_disk_damaged_reports_the_number_and_place_of_its_samples(
    tmp_path, why, lost
):
    """Eight batches are all that it had: then there is no recording, and none is named."""
    written, output = Written(tmp_path, ended=True, why=why), tmp_path / "one.parquet"
    begin, end = written.places[0][0], written.places[lost - 1][1]
    written.path.write_bytes(written.bytes[:begin] + bytes(end - begin) + written.bytes[end:])
    text = why or "the run is complete"
    with locked(written.path) as lock, pytest.raises(DeviceError) as raised:
        record_journal(output, lock, DeviceError, text, None)
    place = recording_path(output, why) if lost == 8 else next(tmp_path.glob("*.parquet"))
    state = (
        "no sample of it can be read, since" if lost == 8 else f"100 samples are in {place}, but"
    )
    assert (
        str(raised.value)
        == f"{text}; {state} the disk did not give back all that was written; check the disk,"
        f" {written.path} is kept"
    )
    assert place.exists() == (lost < 8)
    assert written.path.exists()


def test_no_flipped_bit_in_a_batchs_header_asks_for_more_memory_than_there_is(tmp_path):
    whole = Written(tmp_path, ended=True)
    begin, end = whole.places[3]
    header = 8 + int.from_bytes(whole.bytes[begin + 4 : begin + 8], "little")
    assert header < end - begin
    for at in range(begin, begin + header):
        for bit in range(8):
            whole.path.write_bytes(flipped(whole.bytes, at, bit))
            rows = sum(batch.rows.num_rows for batch in JournalFile(whole.path).batches())
            assert rows >= 3 * BATCH  # all that comes before


def test_a_run_whose_journal_another_process_recovers_leaves_it_to_that(tmp_path):
    """Both would write the recording, and remove the journal twice."""
    journal = tmp_path / "x.journal"
    journal.write_bytes(b"samples")
    over = SimpleNamespace(fault=None, why="")
    with (
        locked(journal) as lock,
        pytest.raises(DeviceError, match=r"another process is making a recording of .*x\.journal"),
    ):
        assert lock.free
        finish_run(tmp_path / "x.parquet", journal, over)
    assert journal.read_bytes() == b"samples"
    assert not (tmp_path / "x.parquet").exists()
