"""Where the real data are: shared/data beside the checkout, or wherever EXOID_REAL_DATA says."""

import os
from pathlib import Path


def real_data_folder() -> Path:
    """Return the folder of recordings that other people made on real machines, whether it is there
    or not."""
    return Path(os.environ.get("EXOID_REAL_DATA") or Path(__file__).parents[3] / "shared" / "data")
