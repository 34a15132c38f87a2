"""A new experiment: a copy of the default one."""

import shutil
from pathlib import Path

from pipelines.contracts.atomic import write_text
from pipelines.errors import SettingsError
from pipelines.settings.datasets import datasets


def create(folder: Path, exoid: str) -> None:
    """Write exoid.toml, rigs/ and Makefile into a folder, without overwriting anything.

    Parameters
    ----------
    folder : Path
        The experiment's folder, created if missing.
    exoid : str
        The default command in the Makefile.

    Raises
    ------
    SettingsError
        If the folder has one of them already.
    """
    source = datasets()
    for name in ("exoid.toml", "rigs", "Makefile"):
        if (folder / name).exists():
            raise SettingsError(
                f"{folder / name}: exists already, not overwritten; choose a new folder"
            )
    shutil.copytree(source / "rigs", folder / "rigs")
    # In a new folder the rigs are inside, not next to it as in the datasets.
    experiment = (source / "experiments" / "default.toml").read_text(encoding="utf-8")
    write_text(folder / "exoid.toml", experiment.replace('"../rigs/', '"rigs/'))
    graph = (source / "experiments" / "experiment.mk").read_text(encoding="utf-8")
    write_text(folder / "Makefile", graph.replace("EXOID ?= exoid\n", f"EXOID ?= {exoid}\n"))
