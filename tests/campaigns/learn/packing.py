"""Evidence as a row of a table: small enough to be kept for thousands of sessions."""

import json
from collections.abc import Mapping
from dataclasses import asdict
from typing import Any

import numpy as np
from numpy.typing import NDArray

from pipelines.diagnosis.selection.evidence import Element, Evidence, Nonnegative


def packed(evidence: Evidence) -> dict[str, Any]:
    """Return a row of a table, with symmetric matrices as their upper triangles."""
    # Single precision, because the Gram matrices are nearly all of a stored session.
    upper = np.triu_indices(evidence.gram.shape[1])
    known = evidence.nonnegative
    return {
        "gram": evidence.gram[:, *upper].astype(np.float32).tobytes(),
        "right": evidence.right.tobytes(),
        "text": json.dumps(
            {
                "elements": [asdict(element) for element in evidence.elements],
                "background": evidence.background,
                "auxiliary": evidence.auxiliary,
                "explained": evidence.explained.tolist(),
                "contexts": evidence.contexts,
                "nonnegative": known and {k: v.tolist() for k, v in vars(known).items()},
            }
        ),
    }


def unpacked(row: Mapping[str, Any]) -> Evidence:
    """Return the evidence of a row from ``packed``."""
    text = json.loads(row["text"])
    explained, known = np.array(text["explained"]), text["nonnegative"]
    right = np.frombuffer(row["right"]).reshape(len(explained), -1)
    return Evidence(
        _symmetric(row["gram"], right.shape),
        right,
        tuple(Element(**one) for one in text["elements"]),
        tuple((place, v, noise) for place, v, noise in text["background"]),
        text["auxiliary"],
        explained,
        known and Nonnegative(**{name: np.array(values) for name, values in known.items()}),
        tuple(map(tuple, text["contexts"])),
    )


def _symmetric(packed: bytes, shape: tuple[int, int]) -> NDArray:
    outputs, n = shape
    full = np.zeros((outputs, n, n))
    upper = np.triu_indices(n)
    full[:, *upper] = np.frombuffer(packed, np.float32).reshape(outputs, -1)
    return full + np.triu(full, 1).transpose(0, 2, 1)
