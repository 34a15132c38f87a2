"""Where the real data are: shared/data next to the checkout, or the folder in EXOID_REAL_DATA."""

import os
from pathlib import Path


def real_data_folder() -> Path:
    """Return the folder of recordings that other people made on real machines, whether it is there
    or not."""
    return Path(os.environ.get("EXOID_REAL_DATA") or Path(__file__).parents[4] / "shared" / "data")
