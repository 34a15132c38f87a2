"""JSON: the whole content of a model's file, with explanations, for programs without Parquet."""

import json
from collections.abc import Mapping
from typing import Any

import pandas as pd

from pipelines.contracts import Joint
from pipelines.contracts.provenance import describe
from pipelines.effects.reference import facts
from pipelines.export.exported import ExportedModel
from pipelines.export.format import Format, exact
from pipelines.model import Term


def _write(exported: ExportedModel, stem: str) -> Mapping[str, str]:
    """Return the document's text."""
    table, mechanism = exported.table, exported.machine.mechanism
    document = {
        "contract": "model/1",
        "name": stem,
        "provenance": describe([table.path] if table.path else []),
        "run": exported.run,
        "mechanism": {"name": mechanism.name, "title": mechanism.title},
        "method": table.metadata.get("method"),
        "joints": [_joint(joint) for joint in exported.joints],
        "geometry": exported.machine.metadata(exported.geometry),
        "conventions": _conventions(),
        # JSON has no NaN.
        "parameters": [
            {str(key): None if pd.isna(value) else value for key, value in row.items()}
            for row in table.frame.to_dict("records")
        ],
        "covariance": table.metadata.get("covariance"),
        "effects": [_effect(term) for term in exported.terms],
        "not_in_this_run": [_effect(term) | {"why": why.how} for term, why in exported.absent],
    }
    return {".json": json.dumps(document, ensure_ascii=False, indent=2, allow_nan=False) + "\n"}


def _conventions() -> dict[str, str]:
    return {
        "units": "SI",
        "angles": (
            "of the first revolute joint from the downward vertical, forward positive, of the next"
            " relative to the previous link; a prismatic joint rises if gravity acts; all as"
            " encoder readings"
        ),
        "torques": (
            "positive torque accelerates its angle upward; an effect's equation is the torque that"
            " the drive must add"
        ),
        "covariance": (
            "of the parameters' values, rows and columns in their order; null if it was not"
            " estimated"
        ),
    }


def _joint(joint: Joint) -> dict[str, str]:
    units = {f"{quantity}_unit": joint.unit(quantity) for quantity in ("angle", "torque")}
    return {"name": joint.name, "kind": joint.kind} | units


def _effect(term: Term) -> dict[str, Any]:
    """Return a term's description and values."""
    effect = term.effect
    stated = facts(type(effect))
    values = effect.physical(term.values)
    return {
        "effect": effect.name,
        "joint": effect.joint,
        **{key: stated[key] for key in ("side", "equation", "meaning", "source")},
        "values": [
            {
                "name": p.name,
                "symbol": p.symbol,
                "value": float(value),
                "unit": p.unit,
                "meaning": p.meaning,
            }
            for p, value in zip(effect.parameters, values, strict=True)
        ],
    }


JSON = Format(
    "json",
    "JSON document",
    ".json",
    lambda term: exact("parameters, with intervals and covariance"),
    _write,
)
