"""Nothing is dropped silently, and nothing that a file says can break another program's file."""

import re
from dataclasses import replace
from xml.etree import ElementTree as ET

import numpy as np
import pytest

from pipelines.effects import EFFECTS
from pipelines.errors import InputError
from pipelines.export import FORMATS, JSON, MATLAB, MJCF, URDF, C, Degree, exported
from tests.effects.catalogue import SIZES
from tests.export.machines import CAUSES, LEG, frame_of, machine, named, table_of, torque
from tests.export.test_source_code import in_c

HOSTILE = [
    ("*/ int main(void) { return 1; } /*", "*/ int main(void) { return 1; } /*?"),
    ('"><joint name="', "-- --> <!-- & ]]>"),
    ("hip\nsystem('true');%{", "knee\x00\x1b[31m\u2028"),
    (" ", "  "),
    ("a b", "a-b"),
    ("ünïcode 膝", "\\"),
]
hostile = pytest.mark.parametrize("joints", HOSTILE, ids=range(len(HOSTILE)))


def causes_of(effect):
    return [term for term in CAUSES if isinstance(term.effect, effect)]


@pytest.mark.parametrize("format", FORMATS, ids=lambda format: format.name)
@pytest.mark.parametrize(
    "effect", [e for e in EFFECTS if e.name in SIZES], ids=lambda effect: effect.name
)
def test_every_effect_is_held_or_listed_with_its_parameters(effect, format):
    for term in causes_of(effect) or [LEG[0]]:
        made = machine(*LEG, *([term] if term is not LEG[0] else []))
        (holding,) = [h for t, h in made.holdings(format) if t.effect.label == term.effect.label]
        text = "\n".join(format.write(made, "leg").values())
        assert holding.how
        if format is JSON or holding.degree is not Degree.EXACT:
            for parameter, value in zip(
                term.effect.parameters, term.effect.physical(term.values), strict=True
            ):
                assert parameter.name in text
                assert f"{value:.9g}"[:6] in text
        if format is not JSON:
            assert f"{term.effect.label}: {holding.degree}" in text


def test_a_format_that_holds_an_effect_shows_it():
    """The file with the effect differs from the file without it by more than its comment."""
    without = machine(*LEG)
    plain = {format.name: bare(format, without) for format in FORMATS}
    for term in CAUSES:
        made = machine(*LEG, term)
        for format in FORMATS:
            held = format.holding(term).degree is not Degree.NOT
            assert (bare(format, made) != plain[format.name]) == held, (
                format.name,
                term.effect.label,
            )


def bare(format, made):
    text = "\n".join(format.write(made, "leg").values())
    text = re.sub(r"<!--.*?-->|/\*.*?\*/|%[^\n]*", "", text, flags=re.DOTALL)
    return [line for line in text.splitlines() if line.strip()]


@hostile
def test_no_joint_name_breaks_the_c_or_changes_what_it_computes(joints, compiled, states):
    cause = named("parallel_spring@knee")
    library = compiled({"leg": machine(*LEG, cause, joints=joints)})
    np.testing.assert_array_equal(
        in_c(library, "leg", states)[0],
        in_c(compiled({"leg": machine(*LEG, cause)}), "leg", states)[0],
    )


def test_no_joint_name_breaks_the_matlab_or_changes_what_it_computes(in_octave, states):
    few = type(states)(*(part[:3] for part in (states.t, states.q, states.dq, states.ddq)))
    models = {
        f"leg{i}": machine(*LEG, named("parallel_spring@knee"), joints=j)
        for i, j in enumerate(HOSTILE)
    }
    expected = torque(models["leg0"], few)
    for found in in_octave(models, few).values():
        np.testing.assert_allclose(found["tau"], expected, rtol=1e-12)


@hostile
@pytest.mark.parametrize("format", [MJCF, URDF], ids=lambda format: format.name)
def test_no_joint_name_breaks_the_xml(joints, format):
    made = machine(*LEG, named("stribeck_friction@knee"), joints=joints)
    root = ET.fromstring(format.write(made, 'l"e<g')[format.suffix].encode())
    names = [joint.get("name") for joint in root.iter("joint")]
    assert len(set(names)) == 2 and all(names)
    if format is MJCF:
        mujoco = pytest.importorskip("mujoco")
        assert mujoco.MjModel.from_xml_string(format.write(made, "leg")[".xml"]).nv == 2
    else:
        pinocchio = pytest.importorskip(
            "pinocchio", reason="pinocchio is not installed; `make install` brings it"
        )
        assert pinocchio.buildModelFromXML(format.write(made, "leg")[".urdf"]).nv == 2


@pytest.mark.parametrize("format", [C, MATLAB], ids=lambda format: format.name)
@pytest.mark.parametrize("stem", ["my leg", "2legs", "leg__", "leg-1", 'x"; y', "ß"])
def test_a_file_name_that_no_function_can_have_is_refused(format, stem):
    with pytest.raises(InputError, match="its functions have the file's name"):
        format.write(machine(*LEG), stem)


def test_what_acts_in_other_runs_is_listed_as_absent():
    frame = frame_of([*LEG, named("passive_joint_torque@knee")], "exo_alone")
    made = exported(type(table_of(*LEG))(frame, table_of(*LEG).metadata | {"covariance": None}))
    ((term, holding),) = made.absent
    assert (
        term.effect.label == "passive_joint_torque@knee"
        and holding.how == "it does not act in exo_alone runs"
    )
    assert (
        "passive_joint_torque@knee: left out (it does not act in exo_alone runs)"
        in C.write(made, "leg")[".c"]
    )


def test_the_wearer_alone_has_no_drives():
    rows = table_of(
        *LEG, named("passive_joint_torque@knee"), named("encoder_offset@hip"), run="human"
    )
    made = exported(rows, "human")
    assert [term.effect.label for term in made.terms] == ["rigid_body", "passive_joint_torque@knee"]
    assert {t.effect.label for t, _ in made.absent} == {
        "friction@hip",
        "friction@knee",
        "encoder_offset@hip",
    }


def test_an_unknown_run_is_refused_with_those_there_are():
    with pytest.raises(
        InputError, match=r"holds no rigid body for run 'human', only for with_human; set --run"
    ):
        exported(table_of(*LEG), "human")


@pytest.mark.parametrize("joint", ["elbow", None])
def test_a_joint_that_the_machine_does_not_have_is_refused_with_those_it_has(joint):
    table = table_of(*LEG)
    table.frame.loc[table.frame["joint"] == "knee", "joint"] = joint
    with pytest.raises(
        InputError,
        match=rf"friction has the joint {joint or 'none'}, expected hip or knee; correct",
    ):
        exported(table)


def test_two_transmissions_of_one_joint_are_listed_though_no_simulation_holds_both():
    made = machine(*LEG, named("backlash@knee"), named("joint_elasticity@knee"))
    degrees = {term.effect.label: holding.degree for term, holding in made.holdings(MJCF)}
    assert (degrees["backlash@knee"], degrees["joint_elasticity@knee"]) == (
        Degree.NOT,
        Degree.EXACT,
    )
    assert {holding.degree for _, holding in made.holdings(JSON)} == {Degree.EXACT}


def test_a_leg_that_cannot_be_is_refused_with_the_reason():
    body = type(LEG[0])(LEG[0].effect, np.array([1.0, 0.9, 2.0, 5.0]))
    with pytest.raises(
        InputError, match=r"not those of a real leg: X2 \(X1 - X2\) = 0\.09 is not above"
    ):
        machine(body)


@pytest.mark.parametrize("format", FORMATS, ids=lambda format: format.name)
def test_friction_that_drives_is_warned_of_and_bodies_keep_its_sound_half(format):
    """A negative half of it is no other program's to run into unseen, and takes no sound half
    along."""
    made = machine(
        LEG[0],
        replace(LEG[1], values=np.array([2.5, -0.4])),
        replace(LEG[2], values=np.array([-0.3, -0.1])),
    )
    warned = made.friction_warnings()
    assert [sentence.partition(" is negative")[0] for sentence in warned] == [
        "friction@hip: viscous = -0.4 N·m·s/rad",
        "friction@knee: coulomb = -0.3 N·m",
        "friction@knee: viscous = -0.1 N·m·s/rad",
    ]
    text = "\n".join(format.write(made, "leg").values())
    assert ("WARNING: friction@hip: viscous = -0.4" in text) == (format is not JSON)
    degrees = {term.effect.label: holding.degree for term, holding in made.holdings(format)}
    if format in (MJCF, URDF):
        assert (degrees["friction@hip"], degrees["friction@knee"]) == (
            Degree.APPROXIMATE,
            Degree.NOT,
        )
        hip = r'frictionloss="2\.5"' if format is MJCF else r'damping="0(\.0)?" friction="2\.5"'
        assert len(re.findall(hip, text)) == 1


@pytest.mark.parametrize("format", [MJCF, URDF], ids=lambda format: format.name)
def test_a_mechanism_without_known_bodies_is_refused_in_a_line(format):
    """As of a mechanism that another file brings; equations can be written of it all the same."""
    known = machine(*LEG)
    other = replace(
        known,
        machine=replace(known.machine, mechanism=replace(known.machine.mechanism, title="a crane")),
    )
    with pytest.raises(
        InputError,
        match=r"leg \(a crane\) has no rule for its bodies' masses. Export to c, matlab or json",
    ):
        format.write(other, "crane")
