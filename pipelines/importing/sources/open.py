"""Choose the reader of a file by its content, not its name."""

from collections.abc import Callable
from pathlib import Path
from zipfile import ZipFile, is_zipfile

from pipelines.errors import InputError
from pipelines.importing.sources.excel import open_excel
from pipelines.importing.sources.hdf5 import open_hdf5
from pipelines.importing.sources.json_text import open_json
from pipelines.importing.sources.lvm import MAGIC, open_lvm
from pipelines.importing.sources.matlab import open_matlab
from pipelines.importing.sources.mdf import open_mdf
from pipelines.importing.sources.numpy_archive import open_numpy
from pipelines.importing.sources.parquet import open_parquet
from pipelines.importing.sources.rosbag import open_rosbag
from pipelines.importing.sources.source import Source
from pipelines.importing.sources.tdms import open_tdms
from pipelines.importing.sources.text import open_text
from pipelines.settings.import_map import SourceSettings
from pipelines.validation.suggestion import similar_file

BEGINNINGS: dict[bytes, Callable[[Path, SourceSettings], Source]] = {
    b"PAR1": open_parquet,
    b"\x89HDF\r\n\x1a\n": open_hdf5,
    b"MATLAB": open_matlab,
    b"\x89MCAP0": open_rosbag,
    b"SQLite format 3\0": open_rosbag,
    b"#ROSBAG V": open_rosbag,
    b"TDSm": open_tdms,
    b"MDF     ": open_mdf,
    b"UnFinMF ": open_mdf,
    b"\x93NUMPY": open_numpy,
    MAGIC: open_lvm,
}
"""First bytes of a file, by format."""


def open_source(path: Path, settings: SourceSettings) -> Source:
    """Return the log in a file, whatever its format.

    Raises
    ------
    InputError
        If there is no such file, or it is damaged or of an unknown format.
    """
    source = _reader(path)(path, settings)
    if not source.names:
        raise InputError(
            f"holds no column of numbers, read as {source.format}; "
            "export it with plain arrays (of a MATLAB table, table2struct or writetable)"
        )
    return source


def _reader(path: Path) -> Callable[[Path, SourceSettings], Source]:
    """Return the function that opens a file of its format."""
    if not path.exists():
        raise InputError(f"no such file; {similar_file(path) or 'check the name'}")
    if path.is_dir():
        if not (path / "metadata.yaml").exists():
            raise InputError(
                "is a folder, expected a log or the folder of a ROS 2 bag; name a file in it"
            )
        return open_rosbag
    # The file is read more than once, and an idle pipe would block without end.
    if not path.is_file():
        raise InputError(
            "is a pipe or a device, expected a file; write its content to a file and name that"
        )
    with open(path, "rb") as file:
        start = file.read(64)
    if not start:
        raise InputError("is empty (0 bytes), expected a log; record or copy it again")
    for beginning, reader in BEGINNINGS.items():
        if start.startswith(beginning):
            return reader
    if is_zipfile(path):
        parts = ZipFile(path).namelist()
        if "xl/workbook.xml" in parts:
            return open_excel
        if any(part.endswith(".npy") for part in parts):
            return open_numpy
        raise InputError("is a zip archive, expected a log; unpack it and name a file in it")
    # Workbooks and NumPy archives end with a list of their parts, without which none is found.
    if start.startswith(b"PK\x03\x04"):
        raise InputError("is a damaged or truncated workbook or archive; copy it again")
    if path.suffix == ".mat":  # v4 has no signature
        return open_matlab
    is_json = start.removeprefix(b"\xef\xbb\xbf").lstrip()[:1] in (b"{", b"[")
    return open_json if is_json and b"\0" not in start else open_text
