"""Where the shipped data lie: beside the code in a checkout, inside the package once installed."""

from pathlib import Path

import pipelines


def datasets() -> Path:
    """Return the folder with rigs/, experiments/ and paper/."""
    package = Path(pipelines.__file__).parent
    installed = package / "_datasets"
    return installed if installed.is_dir() else package.parent / "datasets"
