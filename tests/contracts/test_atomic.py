"""Files are whole or not there, and a folder that takes none is refused before the work."""

import errno
from pathlib import Path

import pytest

from pipelines.contracts import atomic
from pipelines.contracts.atomic import open_folder

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
