import numpy as np
import pytest

from pipelines.acquisition.journal import FLUSH_S, Journal, refuse_leftover
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


def test_what_was_appended_is_on_disk_before_the_journal_is_closed(tmp_path, monkeypatch):
    path = tmp_path / "run.journal"
    journal = fill(path, 0)
    now = 0.0
    monkeypatch.setattr("pipelines.acquisition.journal.time.monotonic", lambda: now)
    journal._flushed = 0.0
    for k in range(400):
        now = k / 200
        journal.append([now, 0.0, k])
        lost = k + 1 - len(read_journal(path)[0])
        assert lost <= FLUSH_S * 200 + 1
    journal.close()


def test_a_killed_runs_journal_is_not_recorded_over(tmp_path):
    path = tmp_path / "run.parquet.journal"
    fill(path, 100).close()
    with pytest.raises(InputError) as caught:
        refuse_leftover(path)
    assert str(caught.value) == (
        f"{path}: holds 100 samples of a run exo_alone that was killed; `exoid recover {path}` makes a recording of "
        "them; or delete it"
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
