"""Where the real data are: the folder in EXOID_REAL_DATA, or else real-data."""

import os
from pathlib import Path


def real_data_folder() -> Path:
    """Return the folder of recordings that other people made on real machines, whether it is there
    or not."""
    # Not in build, which ``make clean`` removes.
    default = Path(__file__).parents[3] / "real-data"
    return Path(os.environ.get("EXOID_REAL_DATA") or default).absolute()
