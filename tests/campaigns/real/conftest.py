"""Real data for tests, where there are any."""

from pathlib import Path

import pytest

from tests.campaigns.real.folder import real_data_folder


@pytest.fixture(scope="session")
def real_data() -> Path:
    """Return the folder of recordings that other people made on real machines; skip the test where
    it is absent."""
    folder = real_data_folder()
    if not folder.is_dir():
        pytest.skip(f"no real data in {folder}; EXOID_REAL_DATA names their folder")
    return folder
