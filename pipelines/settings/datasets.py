"""The folder of the shipped data: next to the code in a checkout, else in the package."""

from pathlib import Path

import pipelines


def datasets() -> Path:
    """Return the folder with rigs/, experiments/ and paper/."""
    package = Path(pipelines.__file__).parent
    installed = package / "_datasets"
    return installed if installed.is_dir() else package.parent / "datasets"
