"""Where the real data are: shared/data beside the checkout, or wherever EXOID_REAL_DATA says."""

import os
from pathlib import Path

import pytest


@pytest.fixture(scope="session")
def real_data() -> Path:
    """Return the folder of recordings that other people made on real machines; skip the test where it is absent."""
    folder = Path(os.environ.get("EXOID_REAL_DATA") or Path(__file__).parents[3] / "shared" / "data")
    if not folder.is_dir():
        pytest.skip(f"no real data in {folder}; EXOID_REAL_DATA names their folder")
    return folder
