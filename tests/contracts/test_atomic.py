"""Files are whole or not there, and a folder that takes none is refused before the work."""

import errno
import os
from pathlib import Path

import pytest

from pipelines.contracts import atomic
from pipelines.contracts.atomic import open_folder, write_text
from pipelines.contracts.parquet import refuse_place
from pipelines.errors import InputError

of_linux = pytest.mark.skipif(not Path("/dev/full").exists(), reason="needs Linux's /proc and /dev/full")


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
@pytest.mark.parametrize("write", [lambda p: write_text(p, "x"), lambda p: refuse_place(p, "recording/1")])
@pytest.mark.parametrize("linked", [False, True])
def test_a_pipe_is_not_replaced_by_a_file(tmp_path, write, linked):
    pipe = place = tmp_path / "pipe"
    os.mkfifo(pipe)
    if linked:
        place = tmp_path / "link"
        place.symlink_to(pipe)
    with pytest.raises(InputError) as refused:
        write(place)
    assert str(refused.value) == f"{place}: is a pipe or a device, expected the name of a file to write; name another"
    assert pipe.is_fifo()
    assert {path.name for path in tmp_path.iterdir()} == {"pipe", place.name}


def test_a_folder_is_not_replaced_by_a_file(tmp_path):
    with pytest.raises(InputError, match="is a folder, expected the name of a file to write"):
        write_text(tmp_path, "x")
