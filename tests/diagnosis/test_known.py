"""What drawings show of a machine is part of the model that everything is held against, and is
searched for no more."""

import pytest

from pipelines.diagnosis.diagnose import diagnose
from pipelines.diagnosis.verdict.candidate_table import candidates
from pipelines.diagnosis.verdict.verdict import verdict
from pipelines.errors import InputError
from pipelines.model import model_from_parameters
from tests.diagnosis.sessions import session


@pytest.mark.slow
@pytest.mark.parametrize(
    ("label", "values"),
    [
        ("rotor_inertia@knee", {"inertia": 0.12}),
        ("parallel_spring@knee", {"stiffness": 6.0, "rest_angle": -0.5}),
    ],
)
def test_what_is_known_is_fitted_to_its_truth_and_missed_no_more(label, values):
    motions = session(*label.split("@"), seed=5, **values)
    diagnosis = diagnose(motions, known=[label])
    outcome = verdict(diagnosis)
    assert outcome["status"] == "nothing_missing"
    assert label in outcome["caveats"][0]
    (known,) = outcome["known"]
    for parameter in known["parameters"]:
        low, high = parameter["ci95"]
        assert low < values[parameter["name"]] < high
    assert not any(label in tried for tried in candidates(diagnosis)["causes"])
    terms = model_from_parameters(diagnosis.parameters, "with_human", motions[0].machine)
    assert label in [term.effect.label for term in terms]


@pytest.mark.slow
def test_something_else_is_found_in_addition_to_what_is_known():
    outcome = verdict(
        diagnose(session("torque_gain", "hip", seed=3, gain=1.08), known=["rotor_inertia@knee"])
    )
    assert [(cause["effect"], cause["joint"]) for cause in outcome["causes"]] == [
        ("torque_gain", "hip")
    ]
    low, high = outcome["known"][0]["parameters"][0]["ci95"]
    assert low < 0.0 < high  # this leg has none


@pytest.mark.parametrize(
    ("label", "goes_on"),
    [
        ("rotor_inertia@hip", "; correct it"),
        ("rotor_inertia", "; correct it"),
        ("backlash@knee", " or "),
        ("friction@hip", " or "),
        ("torque_offset@hip", " or "),
    ],
)
def test_what_no_drawing_shows_or_the_joint_cannot_have_is_refused_with_what_can_be_given(
    label, goes_on
):
    with pytest.raises(
        InputError, match=f"diagnose.known: found {label}, expected rotor_inertia@knee{goes_on}"
    ):
        diagnose(session(seconds=10.0), known=[label])
