"""Files are whole or not there, and a folder that takes none is refused before the work."""

import errno
import json
import os
from pathlib import Path

import pyarrow as pa
import pytest

from pipelines.contracts import atomic, parquet
from pipelines.contracts.atomic import all_or_none, open_folder, write_text
from pipelines.contracts.parquet import refuse_place
from pipelines.errors import InputError

of_linux = pytest.mark.skipif(
    not Path("/dev/full").exists(), reason="needs Linux's /proc and /dev/full"
)


def test_a_folder_is_made_and_left_empty(tmp_path):
    open_folder(tmp_path / "a" / "b")
    assert list((tmp_path / "a" / "b").iterdir()) == []


@of_linux
def test_a_folder_in_which_nobody_can_write_is_refused_by_its_name():
    with pytest.raises(OSError) as refused:
        open_folder(Path("/proc"))
    assert refused.value.filename == "/proc"


@of_linux
def test_a_full_disk_is_refused_though_it_takes_names(tmp_path, monkeypatch):
    monkeypatch.setattr(atomic.tempfile, "TemporaryFile", lambda dir: open("/dev/full", "wb"))  # noqa: SIM115
    with pytest.raises(OSError) as refused:
        open_folder(tmp_path)
    assert (refused.value.errno, refused.value.filename) == (errno.ENOSPC, str(tmp_path))


@pytest.mark.skipif(not hasattr(os, "mkfifo"), reason="needs named pipes")
@pytest.mark.parametrize(
    "write", [lambda p: write_text(p, "x"), lambda p: refuse_place(p, "recording/1")]
)
@pytest.mark.parametrize("linked", [False, True])
def test_a_pipe_is_not_replaced_by_a_file(tmp_path, write, linked):
    pipe = place = tmp_path / "pipe"
    os.mkfifo(pipe)
    if linked:
        place = tmp_path / "link"
        place.symlink_to(pipe)
    with pytest.raises(InputError) as refused:
        write(place)
    assert (
        str(refused.value)
        == f"{place}: is a pipe or a device, expected the name of a file to write; name another"
    )
    assert pipe.is_fifo()
    assert {path.name for path in tmp_path.iterdir()} == {"pipe", place.name}


def test_a_folder_is_not_replaced_by_a_file(tmp_path):
    with pytest.raises(InputError, match="is a folder, expected the name of a file to write"):
        write_text(tmp_path, "x")


def test_the_last_file_is_never_seen_with_others_than_it_was_made_with(tmp_path, monkeypatch):
    def make(**texts):
        with all_or_none(tmp_path, last="a") as result:
            for name, text in texts.items():
                write_text(result / name, text)

    make(a="one", b="one")
    real = os.replace
    monkeypatch.setattr(
        atomic.os,
        "replace",
        lambda new, old: exit("killed") if old == tmp_path / "b" else real(new, old),
    )
    with pytest.raises(SystemExit):
        make(a="two", b="two")
    assert {path.name: path.read_text() for path in tmp_path.iterdir()} == {"b": "one"}


def test_the_error_of_a_full_disk_names_the_file_not_its_temporary_name(tmp_path):
    with pytest.raises(OSError) as refused, all_or_none(tmp_path) as result:
        raise OSError(errno.ENOSPC, "No space left on device", str(result / "b"))
    assert refused.value.filename == str(tmp_path / "b")


TABLE = pa.table({"time_s": [0.0, float("nan"), 2.0]})


def save_table(path, when, table=TABLE, **more):
    parquet.save(path, [table], {"contract": "x/1", "created_at": when, **more})


def save_text(path, when, value=1):
    write_text(path, json.dumps({"value": value, "provenance": {"created_at": when}}))


def save_together(path, when):
    with all_or_none(path.parent) as folder:
        save_table(folder / path.name, when)


@pytest.mark.parametrize("save", [save_table, save_text, save_together])
def test_what_is_made_anew_and_says_the_same_stays_byte_for_byte_with_a_new_time(tmp_path, save):
    path = tmp_path / "result.parquet"
    save(path, "2026-01-01T00:00:00+00:00")
    before = path.read_bytes()
    os.utime(path, (0, 0))
    save(path, "2026-01-02T00:00:00+00:00")
    assert path.read_bytes() == before
    assert path.stat().st_mtime > 0
    assert list(tmp_path.iterdir()) == [path]


@pytest.mark.parametrize(
    ("save", "other"),
    [
        (save_text, {"value": 2}),
        (save_table, {"config": {"order": 2}}),
        (save_table, {"table": pa.table({"time_s": [0.0, 1.0, 2.0]})}),
        (save_table, {"table": TABLE.rename_columns(["time_z"])}),
        (
            save_table,
            {
                "table": pa.table(
                    [[0.0, 1.0, 2.0]], pa.schema([pa.field("time_s", "double", True, {"u": "s"})])
                )
            },
        ),
    ],
)
def test_what_says_something_else_replaces_what_was_there(tmp_path, save, other):
    path, then, now = (
        tmp_path / "result.parquet",
        "2026-01-01T00:00:00+00:00",
        "2026-01-02T00:00:00+00:00",
    )
    save(path, then)
    save(path, now, **other)
    assert now.encode() in path.read_bytes()
    assert then.encode() not in path.read_bytes()


def test_what_is_left_of_a_table_is_replaced(tmp_path):
    path = tmp_path / "result.parquet"
    save_table(path, "2026-01-01T00:00:00+00:00")
    whole = path.read_bytes()
    path.write_bytes(whole[:-20] + bytes(20))
    save_table(path, "2026-01-01T00:00:00+00:00")
    assert path.read_bytes() == whole


def test_a_dash_is_no_name_of_a_file(tmp_path):
    for write in (lambda path: write_text(path, "x"), open_folder):
        with pytest.raises(InputError, match=r"^-: standard output is not supported"):
            write(tmp_path / "-")
    assert list(tmp_path.iterdir()) == []
