"""Every set of causes and laws that the diagnosis compared."""

from collections.abc import Sequence
from typing import Any

import numpy as np

from pipelines.report.session import Session
from pipelines.wording.causes import any_label_in_words, labels_in_words, shares_in_words
from pipelines.wording.numbers import digits

Row = dict[Any, Any]


def candidates(session: Session) -> list[dict[str, Any]]:
    """Return the rows of the template's table of candidates, the best first."""
    if session.candidates is None:
        return []
    rows = session.candidates.frame.sort_values("rank").to_dict("records")
    labels = {label for row in rows for label in row["causes"]}
    named = next((row for row in rows if row["verdict"] == "named"), None)
    # The table does not say whether another set's zeros are one for all runs or each run's own.
    words = shares_in_words(session.causes)
    shown = []
    tones = {"named": "good", "indistinguishable": "warn", "unlisted": "warn"}
    for row in rows:
        extra = _beyond(row, named)
        known = words if row["verdict"] in ("named", "indistinguishable") else {}
        # A set that contains the named one is shown by what it adds, in words and in gain.
        if extra is None or named is None:
            gain = _total_gain(row)
        else:
            gain = _extra_gain(session, named, row)
        shown.append(
            {
                "rank": row["rank"],
                "is_more": extra is not None,
                "words": [
                    known.get(label) or any_label_in_words(label)
                    for label in (row["causes"] if extra is None else extra)
                ],
                "probability": _probability(row["probability"]),
                "verdict": row["verdict"],
                "tone": tones.get(row["verdict"], ""),
                "falls": _falls(session, row),
                "gain": gain,
                "reason": labels_in_words(_reason(row["reason"], extra or ()), labels),
            }
        )
    return shown


def _falls(session: Session, row: Row) -> list[str]:
    texts = []
    for joint in session.measured_joints:
        before, after = row[joint.column("rmse_before")], row[joint.column("rmse_after")]
        if np.isfinite(after):
            texts.append(f"{joint.name} {digits(before)} → {digits(after)}")
    return texts


def _beyond(row: Row, named: Row | None) -> list[str] | None:
    """Return the labels that a set has in addition to the named ones; None if it is no superset."""
    if named is None or not set(named["causes"]) < set(row["causes"]):
        return None
    return [label for label in row["causes"] if label not in set(named["causes"])]


def _reason(reason: str, extra: Sequence[str]) -> str:
    """Return why a set is not named, without its probability and the labels, which have columns."""
    first, _, others = reason.partition("; ")
    sentence = others if first.startswith("its probability is ") else reason
    return sentence.removeprefix(f"{' and '.join(sorted(extra))} ")


def _probability(value: float) -> str:
    """Return a probability in words; a dash for a set that was not weighed."""
    if not np.isfinite(value):
        return "–"
    return f"{value:.2f}" if value >= 0.005 else "< 0.01"


def _extra_gain(session: Session, less: Row, more: Row) -> str:
    """Return the gain of a set over a smaller one, at the joint where it is largest."""
    after = [joint.column("rmse_after") for joint in session.measured_joints]
    return digits(max(less[column] - more[column] for column in after))


def _total_gain(row: Row) -> str:
    """Return the gain of a set over the baseline with its interval, which a short run lacks."""
    if not np.isfinite(row["gain_nm"]):
        return "–"
    low, high = row["gain_low_nm"], row["gain_high_nm"]
    interval = f" ({digits(low)} … {digits(high)})" if high > low else " (no interval)"
    return digits(row["gain_nm"]) + interval
