"""What the recordings could have shown at all, as ``exoid detect`` says."""

import json
from math import inf
from pathlib import Path

NAME = "detectability.json"


def smallest_visible(folder: Path) -> dict[tuple[str, str | None], float] | None:
    """Return the smallest size of each cause that would be seen, rms N·m at its joint; None where
    nobody says.

    The file is a list under ``causes`` of ``effect``, ``joint`` (null for the whole leg) and
    ``smallest_rms_nm``: rms of the effect's torque away from reversals, pooled over the runs it
    acts in; null where none would be seen.
    """
    path = folder / NAME
    if not path.exists():
        return None
    rows = json.loads(path.read_text())["causes"]
    return {
        (row["effect"], row["joint"]): inf
        if row["smallest_rms_nm"] is None
        else float(row["smallest_rms_nm"])
        for row in rows
    }
