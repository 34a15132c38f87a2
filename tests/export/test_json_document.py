"""The JSON document holds all of the model."""

import json

import numpy as np
import pandas as pd
import pytest

from pipelines.export import JSON, exported
from pipelines.mechanics.geometry import Geometry
from pipelines.model import model_from_parameters
from tests.export.machines import CAUSES, LEG, machine, together, torque
from tests.export.machines import table_of as table


@pytest.mark.parametrize(
    "term", [None, *CAUSES], ids=lambda term: term.effect.label if term else "bare"
)
def test_torque_from_the_document_is_that_of_the_model(term, states):
    made = machine(*LEG, *([term] if term else []))
    said = json.loads(JSON.write(made, "leg")[".json"])
    from dataclasses import replace

    read = replace(
        made,
        model=model_from_parameters(pd.DataFrame(said["parameters"]), said["run"], made.machine),
        geometry=Geometry(**said["geometry"]),
    )
    np.testing.assert_array_equal(
        torque(read, states, measured=True), torque(made, states, measured=True)
    )
    for mine, theirs in zip(made.model, read.model, strict=True):
        np.testing.assert_array_equal(mine.values, theirs.values)


def test_every_parameter_has_a_unit_a_meaning_and_its_covariance():
    said = json.loads(JSON.write(machine(*together()), "leg")[".json"])
    count = len(said["parameters"])
    assert np.shape(said["covariance"]) == (count, count)
    assert all(row["unit"] for row in said["parameters"])
    assert all(v["meaning"] and v["unit"] for effect in said["effects"] for v in effect["values"])


def test_what_was_not_estimated_is_null_and_not_a_word_that_json_lacks():
    rows = table(*LEG)
    rows.frame.loc[0, "std_error"] = np.nan
    rows.metadata["covariance"] = None
    said = json.loads(JSON.write(exported(rows), "leg")[".json"], parse_constant=pytest.fail)
    assert said["parameters"][0]["std_error"] is None
