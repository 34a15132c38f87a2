"""A model written as ``parameters/1`` and read again is the same model."""

import numpy as np
import pandas as pd
import pytest
from numpy.testing import assert_allclose

from pipelines.effects.baseline import RigidBody
from pipelines.errors import InputError
from pipelines.model import Model, Term, model_from_parameters
from tests.effects.catalogue import TERMS

MACHINE, PERSON = np.array([1.0, 0.22, 0.55, 2.3]), np.array([1.6, 0.41, 1.23, 3.4])
BODIES = {"exo_alone": MACHINE, "with_human": MACHINE + PERSON, "human": PERSON}


def rows(term, run=None):
    effect = term.effect
    names = [parameter.name for parameter in effect.parameters]
    given = {"effect": effect.name, "joint": effect.joint, "run": run}
    return [
        given | {"name": name, "value": value}
        for name, value in zip(names, effect.physical(term.values), strict=True)
    ]


def table(*terms):
    bodies = [row for run, X in BODIES.items() for row in rows(Term(RigidBody(), X), run)]
    return pd.DataFrame(bodies + [row for term in terms for row in rows(term)])


@pytest.mark.parametrize(
    "term", [t for t in TERMS if t.effect.name != "rigid_body"], ids=lambda term: term.effect.label
)
def test_a_model_survives_its_file(term, with_human):
    body = Term(RigidBody(run="with_human"), BODIES["with_human"])
    written = Model((body, term))
    if term.effect.at_cuff:
        # Machine and limb move apart, so each has its own body.
        written = Model(
            (Term(RigidBody(), MACHINE), Term(RigidBody(run="with_human"), PERSON), term)
        )
    read = model_from_parameters(table(term), "with_human")
    assert_allclose(read.torque(with_human), written.torque(with_human), atol=1e-9)


def test_a_parameter_too_few_is_refused_with_the_names_that_belong_there():
    (spring,) = (t for t in TERMS if t.effect.label == "parallel_spring@knee")
    frame = table(spring)
    with pytest.raises(
        InputError,
        match=(
            "parallel_spring@knee has values stiffness, expected stiffness, rest_angle; correct"
            " them"
        ),
    ):
        model_from_parameters(frame[frame["name"] != "rest_angle"], "with_human")


def test_a_mistyped_parameter_is_refused_with_the_nearest_name():
    (spring,) = (t for t in TERMS if t.effect.label == "parallel_spring@knee")
    frame = table(spring).replace({"name": {"stiffness": "stifness"}})
    with pytest.raises(
        InputError, match=r"has values stifness, rest_angle, expected .*; did you mean stiffness\?"
    ):
        model_from_parameters(frame, "with_human")
