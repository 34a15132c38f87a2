"""The journal of a killed run becomes a whole recording that states what is missing."""

import json
import os
import subprocess
import sys

import numpy as np
import pytest

from pipelines.acquisition.recording.journal import Journal
from pipelines.acquisition.recording.journal_file import JournalFile, refuse_leftover
from pipelines.acquisition.recording.recover import journals_in, recover
from pipelines.contracts import RECORDING
from pipelines.contracts.run_paths import journal_of
from pipelines.errors import InputError
from tests.conftest import Outcome

RATE = 200.0
COLUMNS = [
    "time_s",
    *(f"{joint}_{q}" for joint in ("hip", "knee") for q in ("angle_rad", "torque_nm")),
    "sequence",
]
METADATA = {
    "run": "exo_alone",
    "purpose": "train",
    "sample_rate_hz": RATE,
    "config": {"run": {"duration_s": 1.0}},
}


def row(index):
    angle = 0.001 * (index % 1000)
    return [index / RATE, angle, 1.0, -angle, 2.0, 7000 + index]


def journal_with(output, indices, flush_every=20):
    """Begin a journal as a run does, with samples of these numbers."""
    journal = Journal(journal_of(output), COLUMNS, METADATA)
    for k, index in enumerate(indices):
        journal.append(row(index))
        if k % flush_every == flush_every - 1:
            journal.flush()
    return journal


@pytest.fixture
def killed(tmp_path):
    """The journal of a run of 200 samples that was killed before sample 150, and nobody knows
    it."""
    output = tmp_path / "one.parquet"
    journal = journal_with(output, [*range(40), *range(43, 150)])
    journal.flush()
    journal._file.close()  # as the system does for a process that is no more
    return journal_of(output)


def test_a_killed_run_becomes_a_recording_that_states_what_is_missing(killed, tmp_path):
    recovery = recover(killed)
    table = RECORDING.read(tmp_path / "one.aborted.parquet")
    assert recovery.path == table.path
    assert (recovery.summary.samples, recovery.summary.missed, recovery.summary.cut_off) == (
        147,
        3,
        50,
    )
    assert table.frame["sequence"].tolist() == [7000 + k for k in (*range(40), *range(43, 150))]
    assert table.metadata["gaps"] == [[0.2, 3]]
    assert (
        table.metadata["abort"]
        == "ended 0.750 s into 1 s without a word: killed, or its disk was full"
    )
    assert table.metadata["recovered"] is True
    assert not killed.exists()


def test_wherever_a_journal_was_cut_off_all_whole_batches_are_recovered(killed, tmp_path):
    whole, counts = killed.read_bytes(), []
    for cut in range(0, len(whole), 307):
        killed.write_bytes(whole[:cut])
        try:
            recover(killed, tmp_path / f"{cut}.parquet")
            counts.append(len(RECORDING.read(tmp_path / f"{cut}.parquet").frame))
        except InputError as error:
            assert ("delete it" in str(error)) == (cut <= 512 or "holds no sample" in str(error))
            counts.append(0)
    assert counts == sorted(counts)
    assert set(counts) == set(range(0, 141, 20))  # the last batch, of 7, is never whole here


def test_samples_that_were_missed_before_the_first_one_kept_are_a_gap(tmp_path):
    output = tmp_path / "one.parquet"
    journal_with(output, range(2, 30)).close()
    recover(journal_of(output))
    assert RECORDING.read(tmp_path / "one.aborted.parquet").metadata["gaps"] == [[0.0, 2]]


@pytest.mark.parametrize(
    ("abort", "name", "gaps"),
    [(None, "one.parquet", [[0.95, 10]]), ("the cat came", "one.aborted.parquet", [])],
)
def test_a_run_that_ended_but_could_not_be_written_is_recovered_with_its_own_reason(
    tmp_path, abort, name, gaps
):
    output = tmp_path / "one.parquet"
    journal = journal_with(output, range(190))
    journal.end(abort)
    journal.close()
    assert recover(journal_of(output)).path == tmp_path / name
    metadata = RECORDING.read(tmp_path / name).metadata
    assert (metadata.get("abort"), metadata["gaps"]) == (abort, gaps)


def test_nothing_is_overwritten(killed, tmp_path):
    (tmp_path / "taken.parquet").write_text("a month of work")
    with pytest.raises(InputError) as caught:
        recover(killed, tmp_path / "taken.parquet")
    assert (
        str(caught.value)
        == f"{tmp_path / 'taken.parquet'}: is there already and is not overwritten; name another"
        " file with -o"
    )
    (tmp_path / "one.aborted.parquet").write_text("another")
    assert recover(killed).path == tmp_path / "one.aborted-2.parquet"


@pytest.mark.parametrize("name", ["a.csv", "a", "a.parquet.txt"])
def test_a_recording_is_written_under_no_name_but_that_of_a_parquet_file(killed, tmp_path, name):
    with pytest.raises(InputError) as refused:
        recover(killed, tmp_path / name)
    assert (
        str(refused.value)
        == f"{tmp_path / name}: expected a name that ends in .parquet, which is what is written;"
        " name another"
    )
    assert killed.exists()
    assert not (tmp_path / name).exists()


HOLD = """\
import sys
from pathlib import Path
from pipelines.acquisition.recording.journal import Journal
journal = Journal(Path(sys.argv[1]), ["time_s"], {"run": "exo_alone"})
print("recording", flush=True)
sys.stdin.read()
"""


def test_a_journal_that_another_process_writes_is_left_alone_until_that_is_killed(tmp_path):
    path = tmp_path / "one.parquet.journal"
    process = subprocess.Popen(
        [sys.executable, "-c", HOLD, str(path)],
        stdin=subprocess.PIPE,
        stdout=subprocess.PIPE,
        text=True,
    )
    assert process.stdout.readline() == "recording\n"
    for refuse, words in (
        (recover, "a run is recording there now"),
        (refuse_leftover, "another run is recording"),
    ):
        with pytest.raises(InputError, match=words):
            refuse(path)
    process.kill()
    process.communicate()
    with pytest.raises(InputError, match="of a run exo_alone that was killed; `exoid recover "):
        refuse_leftover(path)


def test_a_folder_stands_for_the_journals_below_it(killed, tmp_path):
    assert journals_in(tmp_path) == [killed]
    assert journals_in(killed) == [killed]
    recover(killed)
    assert journals_in(tmp_path) == []


def test_where_no_run_was_killed_there_is_nothing_to_recover_and_nothing_wrong(
    exoid, monkeypatch, tmp_path
):
    (tmp_path / "exoid.toml").touch()
    monkeypatch.chdir(tmp_path)
    for words in ([], ["."]):
        assert exoid("recover", *words) == Outcome(
            0, "no killed run left a journal; nothing to recover\n", ""
        )
    assert exoid("recover", "no.journal").code == 2


@pytest.mark.parametrize(
    ("column", "value"),
    [
        ("time_s", 0.9),
        ("time_s", 0.1),
        ("time_s", np.nan),
        ("sequence", 7000),
        ("sequence", 2**40),
        ("hip_angle_rad", np.nan),
        ("hip_angle_rad", 1e3),
        ("knee_torque_nm", np.inf),
    ],
)
@pytest.mark.parametrize("at", [100, 119, 120])
def test_a_row_that_no_recording_may_hold_costs_only_itself_and_is_reported(
    tmp_path, column, value, at
):
    output = tmp_path / "one.parquet"
    journal = journal_with(output, range(at))
    journal.append(
        [
            value if name == column else original
            for name, original in zip(COLUMNS, row(at), strict=True)
        ]
    )
    for index in range(at + 1, 200):
        journal.append(row(index))
    journal.end(None)
    journal.close()
    recover(journal_of(output))
    table = RECORDING.read(output)
    assert table.metadata["gaps"] == [[at / RATE, 1]]
    assert table.frame["sequence"].tolist() == [7000 + k for k in range(200) if k != at]


def test_a_damaged_journal_is_kept_next_to_the_recording_of_all_that_can_be_read(tmp_path):
    output = tmp_path / "one.parquet"
    journal = journal_with(output, range(100))
    place = journal.path.stat().st_size
    for index in range(100, 200):
        journal.append(row(index))
        if index % 20 == 19:
            journal.flush()
    journal.end(None)
    journal.close()
    whole = journal.path.read_bytes()
    journal.path.write_bytes(whole[:place] + bytes(8) + whole[place + 8 :])
    recovery = recover(journal.path)
    assert (recovery.path, recovery.summary.damaged, recovery.summary.gaps) == (
        output,
        True,
        [(0.5, 20)],
    )
    assert len(RECORDING.read(output).frame) == 180
    assert journal.path.exists()


class FullAfter:
    """A file on a disk that is full after so many bytes."""

    def __init__(self, file, room):
        self._file, self._room = file, room

    def __getattr__(self, name):
        return getattr(self._file, name)

    def __enter__(self):
        return self

    def __exit__(self, *_):
        self._file.close()

    def write(self, data):
        if not (taken := min(len(data), self._room - self._file.tell())):
            raise OSError(28, "No space left on device")
        return self._file.write(data[:taken])


def test_a_disk_that_fills_up_half_way_through_a_batch_costs_no_earlier_and_no_later_sample(
    tmp_path,
):
    output = tmp_path / "one.parquet"
    journal = journal_with(output, range(40))
    file = journal._file
    journal._file = FullAfter(file, file.tell() + 700)
    with pytest.raises(OSError, match="No space left"):
        for index in range(40, 60):
            journal.append(row(index))
        journal.flush()
    assert sum(batch.rows.num_rows for batch in JournalFile(journal_of(output)).batches()) == 40
    journal._file = file  # there is room again
    journal.close()
    recover(journal_of(output))
    assert len(RECORDING.read(tmp_path / "one.aborted.parquet").frame) == 60


def test_the_values_survive_to_the_last_bit(killed, tmp_path):
    recover(killed)
    frame = RECORDING.read(tmp_path / "one.aborted.parquet").frame
    assert np.array_equal(
        frame["hip_angle_rad"], [0.001 * k for k in (*range(40), *range(43, 150))]
    )


MEASURE = """\
import re, sys
from pathlib import Path
from pipelines.acquisition.recording.journal import Journal
from pipelines.contracts.run_paths import journal_of
from pipelines.acquisition.recording.recover import recover
from tests.acquisition.recording.test_recover import COLUMNS, METADATA, row

def most_held():  # not getrusage: a child's never is less than what its parent held
    return int(re.search(r"VmHWM:\\s+(\\d+)", Path("/proc/self/status").read_text())[1]) / 1024

output, samples = Path(sys.argv[1]), int(sys.argv[2])
with Journal(journal_of(output), COLUMNS, METADATA) as journal:
    for index in range(samples):
        journal.append(row(index))
        if index % 200 == 199:  # a fifth of a second at 1 kHz
            journal.flush()
written = most_held()
assert recover(journal_of(output), output).summary.samples == samples
print(most_held() - written)
"""


def memory_of_recovery(output, samples):
    """Return by how much the most memory that was ever held grows, MiB, when a journal is made a
    recording."""
    command = [sys.executable, "-c", MEASURE, str(output), str(samples)]
    return float(subprocess.run(command, capture_output=True, text=True, check=True).stdout)


@pytest.mark.skipif(
    not sys.platform.startswith("linux"), reason="needs /proc to measure the most memory held"
)
@pytest.mark.parametrize("seconds", [300, pytest.param(3600, marks=pytest.mark.slow)])
def test_at_1_khz_memory_does_not_grow_with_the_length_of_what_is_written_as_a_recording(
    tmp_path, seconds
):
    grown = memory_of_recovery(tmp_path / "long.parquet", 1000 * seconds)
    print(f"\n{seconds} s at 1 kHz: {grown:.0f} MiB")
    assert 1.0 < grown < 64.0  # an hour of these columns is 165 MiB, and as a frame twice that


@pytest.mark.parametrize(
    ("name", "content", "words"),
    [
        (
            "t.toml",
            b"unit = 'rad'",
            "is no journal of a run, nothing was changed; name a *.journal",
        ),
        (
            "one.parquet.journal",
            b"",
            "is no journal of a run, or not even its head was written and so no sample; del",
        ),
    ],
)
def test_only_what_is_left_of_a_journal_without_a_sample_is_to_be_deleted(
    tmp_path, name, content, words
):
    path = tmp_path / name
    path.write_bytes(content)
    with pytest.raises(InputError) as refused:
        recover(path)
    assert str(refused.value).startswith(f"{path}: {words}")
    assert ("delete" in str(refused.value)) == (not content)
    assert path.read_bytes() == content


@pytest.mark.skipif(not hasattr(os, "mkfifo"), reason="needs named pipes")
def test_a_pipe_is_not_waited_for(tmp_path):
    os.mkfifo(tmp_path / "pipe")
    with pytest.raises(InputError, match="is no file, expected the journal that a killed run left"):
        recover(tmp_path / "pipe")


def without_copies(path):
    """Make a journal one whose copies of the head are both damaged."""
    path.write_bytes(path.read_bytes().replace(b"exoid-head:", b"exoid-held:"))


@pytest.mark.parametrize("copies", [True, False])
@pytest.mark.parametrize("at", [6, 20, 300])
def test_one_flipped_bit_in_the_head_never_has_samples_deleted(killed, tmp_path, at, copies):
    if not copies:
        without_copies(killed)
    content = bytearray(killed.read_bytes())
    content[at] ^= 1 << 4
    killed.write_bytes(content)
    if copies:
        recovery = recover(killed)
        assert (recovery.summary.samples, recovery.summary.damaged) == (147, True)
    else:
        for refuse in (recover, refuse_leftover):
            with pytest.raises(InputError) as refused:
                refuse(killed)
            assert str(refused.value).startswith(
                f"{killed}: the head of its {len(content)} bytes, which names the"
            )
            assert "keep it, it may hold samples" in str(refused.value)
            assert "delete" not in str(refused.value)
    assert killed.read_bytes() == content


def test_whatever_bit_of_a_head_without_a_copy_is_flipped_what_is_refused_is_named_and_kept(
    killed, tmp_path
):
    without_copies(killed)
    whole, output = killed.read_bytes(), tmp_path / "made.parquet"
    for at in range(0, len(JournalFile(killed)._head), 7):
        killed.write_bytes(whole[:at] + bytes([whole[at] ^ 0x10]) + whole[at + 1 :])
        try:
            recover(killed, output)
            output.unlink()
        except InputError as error:
            assert str(error).startswith((f"{killed}: ", f"{output}: "))
            assert "delete" not in str(error)
            assert killed.exists()


@pytest.mark.parametrize(
    "changed",
    [{"config": None}, {"config": {"run": 3}}, {"sample_rate_hz": 0}, {"sample_rate_hz": "x"}],
)
def test_metadata_of_which_no_recording_can_be_made_are_refused(tmp_path, monkeypatch, changed):
    path = journal_of(tmp_path / "one.parquet")
    monkeypatch.setattr(
        "pipelines.acquisition.recording.journal.to_json", lambda metadata, _: json.dumps(metadata)
    )
    with Journal(path, COLUMNS, METADATA | changed) as journal:
        journal.append(row(0))
    with pytest.raises(InputError) as refused:
        recover(path)
    assert str(refused.value).startswith(f"{path}: columns or metadata are not those of a run")
    assert refused.value.exit_code == 2
    assert path.exists()


def test_a_journal_without_a_counter_is_refused(tmp_path):
    path = journal_of(tmp_path / "one.parquet")
    with Journal(path, COLUMNS[:-1], METADATA) as journal:
        journal.append(row(0)[:-1])
    with pytest.raises(InputError, match="columns or metadata are not those of a run"):
        recover(path)


@pytest.mark.parametrize(
    ("word", "instead"), [(b"found", b"fo\x00nd"), (b"rows", b"rowz"), (b"{}", b"{{")]
)
def test_last_words_that_are_damaged_are_none_and_cost_no_sample(tmp_path, word, instead):
    output = tmp_path / "one.parquet"
    journal = journal_with(output, range(190))
    journal.end("the cat came")
    journal.close()
    whole = journal.path.read_bytes()
    at = whole.rindex(word)
    journal.path.write_bytes(whole[:at] + instead + whole[at + len(word) :])
    recovery = recover(journal.path)
    assert (recovery.summary.samples, recovery.summary.damaged) == (190, True)
    assert "without a word" in recovery.summary.abort
    assert journal.path.exists()
