"""What the verdict says of each finding: its words, its path, and its unlisted laws."""

from itertools import pairwise
from types import SimpleNamespace

import numpy as np
import pytest

from pipelines.contracts import HIP_AND_KNEE, Joint
from pipelines.diagnosis.selection.answer import answer_of
from pipelines.diagnosis.selection.evidence import Element
from pipelines.diagnosis.selection.findings import findings as read_off
from pipelines.diagnosis.selection.posterior import Posterior
from pipelines.diagnosis.selection.selection import Selection
from pipelines.diagnosis.verdict.findings_in_words import findings
from pipelines.wording.label import effect_labelled


def cause(name: str, joint: str | None, family: str, repeats: bool = True) -> Element:
    label = f"{name}@{joint}" if joint else name
    return Element(label, name, joint, family, False, [0], [1.0], repeats=repeats)


def law(kind: str, joint: str, family: str, repeats: bool = True) -> Element:
    label = f"law:{kind}@{joint}"
    return Element(label, kind, joint, family, True, [0], [1.0], repeats=repeats)


ELEMENTS = (
    cause("coulomb_asymmetry", "hip", "speed"),
    cause("torque_offset", "hip", "sensor"),
    cause("base_tilt", None, "angle"),
    law("angle", "knee", "angle"),
    law("hum", "knee", "time", repeats=False),
    cause("cogging", "knee", "angle"),
    cause("payload_change", "hip", "time", repeats=False),
    law("other_speed", "hip", "speed"),
    law("speed", "hip", "speed"),
)
SPEED, OFFSET, TILT, ANGLE, HUM, COGGING, PAYLOAD, OTHER_SPEED, OWN_SPEED = range(len(ELEMENTS))


def diagnosed(sets, ratios=(), joints=HIP_AND_KNEE, has_periods=True):
    """Return what is read of a diagnosis, of sets with their probabilities."""
    order = sorted(sets, key=lambda chosen: -sets[chosen])
    p = np.array([sets[chosen] for chosen in order])
    trained = Posterior(ELEMENTS, tuple(order), np.log(p))
    answer = answer_of(trained)
    selected = Selection(None, None, trained, trained, answer, tuple(read_off(trained, answer)), ())
    while harm := selected.worst_harm(dict(ratios)):
        selected = selected.judged(harm, harms=True)
    labels = tuple(one.element.label for one in selected.answer.named)
    return SimpleNamespace(
        selected=selected,
        baseline=SimpleNamespace(
            machine=SimpleNamespace(joint={joint.name: joint for joint in joints}.get)
        ),
        effects={label: effect_labelled(label) for label in labels},
        effect_of=effect_labelled,
        causes=labels,
        has_periods=has_periods,
        named=selected.answer.named,
        status="explained" if labels else "unknown_cause",
    )


@pytest.mark.parametrize(("has_periods", "words"), [(True, "repeats with"), (False, "depends on")])
def test_without_periods_nothing_is_said_to_repeat(has_periods, words):
    (finding,) = findings(diagnosed({(ANGLE,): 0.95, (): 0.05}, has_periods=has_periods))
    assert finding["path"][1]["words"] == f"something that {words} the motion"


@pytest.mark.parametrize(
    ("law", "words"),
    [
        (OTHER_SPEED, "a torque at the hip that depends on the other joint's speed"),
        (OWN_SPEED, "a law of the hip's speed"),
    ],
)
def test_a_law_of_the_other_joint_is_of_a_family_of_the_other_joint(law, words):
    (finding,) = findings(diagnosed({(law,): 0.95, (): 0.05}))
    assert (finding["family"], finding["words"]) == ("speed", words)


def levels(finding):
    return [(node["level"], node["value"]) for node in finding["path"]]


def test_a_tie_over_two_families_is_reported_at_the_joint_and_of_no_family():
    (finding,) = findings(diagnosed({(SPEED,): 0.55, (OFFSET,): 0.42, (): 0.03}))
    assert levels(finding) == [
        ("missing", True),
        ("repeats", True),
        ("joint", "hip"),
        ("cause", "coulomb_asymmetry@hip"),
    ]
    assert [one["family"] for one in finding["causes"]] == ["speed", "sensor"]
    assert finding["words"] == "Coulomb asymmetry at the hip"


def test_a_tie_over_two_joints_is_reported_of_no_joint():
    (finding,) = findings(diagnosed({(SPEED,): 0.5, (TILT,): 0.47, (): 0.03}))
    assert [level for level, _ in levels(finding)] == ["missing", "repeats", "cause"]


@pytest.mark.parametrize(
    "sets",
    [
        {(SPEED,): 0.55, (OFFSET,): 0.42, (): 0.03},
        {(SPEED, PAYLOAD): 0.6, (OFFSET,): 0.3, (PAYLOAD,): 0.1},
        {(ANGLE,): 0.7, (COGGING,): 0.2, (HUM,): 0.1},
        {(ANGLE, HUM): 0.6, (COGGING, HUM): 0.3, (HUM,): 0.05, (): 0.05},
    ],
)
def test_no_node_of_a_path_is_more_probable_than_the_one_above(sets):
    for finding in findings(diagnosed(sets)):
        likely = [node["probability"] for node in finding["path"]]
        assert all(below <= above + 1e-12 for above, below in pairwise(likely))


def test_an_unlisted_law_is_said_in_words_with_the_closest_listed_cause():
    (finding,) = findings(diagnosed({(ANGLE,): 0.7, (COGGING,): 0.2, (): 0.1}))
    assert (finding["level"], finding["words"]) == ("family", "a law of the knee's angle")
    (unlisted,) = finding["laws"]
    assert unlisted["words"] == "a law of the knee's angle"
    assert unlisted["probability"] == pytest.approx(0.7)
    assert [(one["words"], one["dropped"]) for one in finding["causes"]] == [
        ("cogging at the knee", False)
    ]


def test_a_joint_that_slides_has_a_law_of_its_position_and_a_force():
    slides = Joint("hip"), Joint("knee", "prismatic")
    (finding,) = findings(diagnosed({(ANGLE,): 0.7, (HUM,): 0.2, (): 0.1}, joints=slides))
    assert finding["words"] == "a law of the knee's position"
    assert finding["laws"][0]["words"] == "a law of the knee's position"


def test_a_cause_that_does_harm_on_the_validation_runs_is_dropped_and_with_it_what_it_explained():
    d = diagnosed({(COGGING,): 0.97, (): 0.03}, {"cogging@knee": -8.0})
    assert d.causes == ()
    assert d.selected.dropped == {"cogging@knee"}
    assert findings(d) == []


def test_a_law_that_takes_the_place_of_a_dropped_cause_is_a_finding_with_it():
    d = diagnosed({(COGGING,): 0.94, (ANGLE,): 0.05, (): 0.01}, {"cogging@knee": -4.0})
    assert d.causes == ()
    (finding,) = findings(d)
    assert (finding["level"], finding["words"]) == ("family", "a law of the knee's angle")
    assert finding["causes"][0]["dropped"]


def test_where_nothing_is_missing_nothing_is_found():
    assert findings(diagnosed({(): 0.9, (SPEED,): 0.1})) == []
