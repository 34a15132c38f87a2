import threading
import time

import numpy as np
import pyarrow as pa
import pytest

from pipelines.acquisition.recording.journal import FLUSH_S, Journal
from pipelines.acquisition.recording.journal_file import JournalFile, refuse_leftover
from pipelines.errors import ContractError, InputError
from tests.acquisition.journals import read_journal

COLUMNS = ["time_s", "hip_angle_rad", "sequence"]


def fill(path, rows):
    journal = Journal(path, COLUMNS, {"run": "exo_alone"})
    for k in range(rows):
        journal.append([k / 200, 0.1 * k, k])
        if k % 50 == 49:
            journal.flush()
    return journal


def test_a_closed_journal_holds_every_row_and_the_metadata(tmp_path):
    path = tmp_path / "run.journal"
    fill(path, 123).close()
    frame, metadata = read_journal(path)
    assert frame["sequence"].tolist() == list(range(123))
    assert metadata == {"run": "exo_alone"}


def test_a_journal_cut_off_anywhere_gives_every_batch_before(tmp_path):
    path = tmp_path / "run.journal"
    fill(path, 200).close()
    whole = path.read_bytes()
    head = len(whole) // 4
    lengths = []
    for cut in range(head, len(whole), 97):
        path.write_bytes(whole[:cut])
        lengths.append(len(read_journal(path)[0]))
    assert set(lengths) <= {0, 50, 100, 150, 200}
    assert lengths == sorted(lengths)
    assert lengths[-1] >= 150


def test_what_was_appended_is_soon_on_disk_though_nothing_is_appended_any_more(tmp_path):
    path = tmp_path / "run.journal"
    with fill(path, 0) as journal:
        journal.append([0.0, 0.0, 0])
        until = time.monotonic() + 60.0
        while not len(read_journal(path)[0]) and time.monotonic() < until:
            time.sleep(FLUSH_S / 10)
        assert len(read_journal(path)[0]) == 1


class Hung:
    """A disk that accepts nothing until it is released."""

    def __init__(self, file):
        self._file, self.goes_on = file, threading.Event()

    def __getattr__(self, name):
        return getattr(self._file, name)

    def __enter__(self):
        return self

    def __exit__(self, *_):
        self._file.close()

    def write(self, data):
        assert self.goes_on.wait(60)
        return self._file.write(data)


def test_a_disk_that_hangs_delays_nothing_and_is_reported_before_memory_is_full(
    tmp_path, monkeypatch
):
    monkeypatch.setattr("pipelines.acquisition.recording.journal.MOST_WAITING", 300)
    path = tmp_path / "run.journal"
    journal = fill(path, 0)
    disk = journal._file = Hung(journal._file)
    began, rows = time.monotonic(), 0
    with pytest.raises(OSError, match="300 samples wait for the disk, which does not answer"):
        while time.monotonic() - began < 60:
            journal.append([rows / 200, 0.0, rows])
            rows += 1
            time.sleep(0.0005)
    disk.goes_on.set()
    journal.close()
    assert read_journal(path)[0]["sequence"].tolist() == list(range(rows + 1))


@pytest.fixture
def three_batches(tmp_path):
    """A whole journal of 150 rows with its last words, and where each of its batches begins."""
    path, places = tmp_path / "run.parquet.journal", []
    journal = fill(path, 0)
    for k in range(150):
        journal.append([k / 200, 0.1 * k, k])
        if k % 50 == 49:
            places.append(path.stat().st_size)
            journal.flush()
    journal.end(None)
    journal.close()
    return path, places


def test_a_batch_that_is_damaged_costs_itself_only_and_that_is_known(three_batches):
    path, places = three_batches
    whole = path.read_bytes()
    for at, was in ((places[1], 50), (places[1] + 6, 50), (places[1] + 40, 50)):
        path.write_bytes(whole[:at] + b"\x5a\x5a\x5a\x5a" + whole[at + 4 :])
        journal = JournalFile(path)
        batches = list(journal.batches())
        assert sum(batch.rows.num_rows for batch in batches) == 150 - was
        assert batches[-1].rows.num_rows == 0
        assert batches[-1].last_words[b"rows"] == b"150"
        assert journal.damaged > 0


def test_a_disk_that_gives_an_error_is_no_end_of_a_journal(three_batches, monkeypatch):
    path, places = three_batches

    class Failing:
        def __init__(self, *arguments):
            self.file = open(*arguments)  # noqa: SIM115

        def __getattr__(self, name):
            return getattr(self.file, name)

        def __enter__(self):
            return self

        def __exit__(self, *_):
            self.file.close()

        def read(self, count=-1):
            if self.file.tell() >= places[1]:
                raise OSError(5, "Input/output error")
            return self.file.read(count)

    journal = JournalFile(path)
    monkeypatch.setattr("pipelines.acquisition.recording.journal_file.open", Failing, raising=False)
    with pytest.raises(
        InputError, match=r"cannot be read \(Input/output error\); nothing was changed"
    ):
        list(journal.batches())


def test_a_killed_runs_journal_is_not_recorded_over(tmp_path):
    path = tmp_path / "run.parquet.journal"
    fill(path, 100).close()
    with pytest.raises(InputError) as caught:
        refuse_leftover(path)
    assert (
        str(caught.value)
        == f"{path}: holds 100 samples of a run exo_alone that was killed; `exoid recover {path}`"
        " makes a recording of them; or delete it"
    )
    assert len(read_journal(path)[0]) == 100


def test_a_journal_without_even_a_head_is_named(tmp_path):
    path = tmp_path / "run.journal"
    path.write_bytes(b"\xff\xff")
    with pytest.raises(ContractError) as caught:
        read_journal(path)
    assert str(caught.value).startswith(f"{path}: is no journal of a run")


def test_values_that_a_sensor_did_not_give_stay_missing(tmp_path):
    path = tmp_path / "run.journal"
    with Journal(path, COLUMNS, {"run": "exo_alone"}) as journal:
        journal.append([0.0, np.nan, 0])
    assert np.isnan(read_journal(path)[0]["hip_angle_rad"][0])


def flipped(whole, at):
    return whole[:at] + bytes([whole[at] ^ 0x10]) + whole[at + 1 :]


def test_no_flipped_bit_in_the_head_costs_a_sample_or_a_word_of_the_metadata(three_batches):
    path, places = three_batches
    whole = path.read_bytes()
    head = len(JournalFile(path)._head)
    assert head < places[0]
    for at in range(head):
        path.write_bytes(flipped(whole, at))
        journal = JournalFile(path)
        assert journal.metadata == {"run": "exo_alone"}
        assert journal.schema.names == COLUMNS
        assert sum(batch.rows.num_rows for batch in journal.batches()) == 150
        assert journal.damaged >= head  # so it is kept


def test_all_that_comes_before_the_first_sample_may_be_lost(three_batches):
    path, places = three_batches
    whole = path.read_bytes()
    path.write_bytes(bytes(places[0]) + whole[places[0] :])
    frame, metadata = read_journal(path)
    assert frame["sequence"].tolist() == list(range(150))
    assert metadata == {"run": "exo_alone"}


def test_a_damaged_copy_of_the_head_is_not_believed(three_batches):
    path, _ = three_batches
    whole = path.read_bytes()
    place = whole.index(b"exoid-head:") + 40
    path.write_bytes(flipped(whole, place).replace(b"exoid-head:", b"exoid-held:", 2)[: len(whole)])
    assert read_journal(path)[1] == {"run": "exo_alone"}
    path.write_bytes(flipped(flipped(whole, place), 6))
    assert read_journal(path)[1] == {"run": "exo_alone"}  # from the copy at the end


def test_a_run_that_is_killed_before_its_first_sample_has_no_last_words(tmp_path):
    path = tmp_path / "run.journal"
    journal = fill(path, 0)
    assert [batch.last_words for batch in JournalFile(path).batches()] == [None, None]
    journal.close()


def test_other_readers_of_arrow_read_a_journal_as_it_is(three_batches):
    assert pa.ipc.open_stream(three_batches[0]).read_all()["sequence"].to_pylist() == list(
        range(150)
    )
