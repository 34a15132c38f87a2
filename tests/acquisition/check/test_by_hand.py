"""A leg that a person moves shows which register is which, with its sign and scale."""

import re
from dataclasses import replace

import numpy as np
import pytest

from pipelines.acquisition.check import by_hand
from pipelines.mechanics.motion import CUFFS
from pipelines.rig.plant import Plant

ANGLE = 'angle = { address = 104, type = "int32", scale = 1e-6, unit = "rad" }'
FORCE_Y = 'force_y = { address = 104, type = "float32", unit = "N" }'
HALF = 100
"""Samples in which the hand moves there, and as many back."""


class Hand:
    """An operator who follows the instructions, in a simulated rig."""

    def __init__(self):
        self.prompts, self.remaining, self.place, self.asked = [], 0, "", ""
        self.does = True

    async def ready(self, prompt):
        self.prompts.append(prompt)
        self.place, _, self.asked = prompt.partition(": ")
        self.remaining = 2 * HALF if self.does and self.place in ("hip", "knee", *CUFFS) else 0

    def on(self, samples):
        """Return samples with what the hand does in them."""
        push = np.sin(np.pi * self.remaining / (2 * HALF))
        speed = -np.pi / (2 * HALF) * np.cos(np.pi * self.remaining / (2 * HALF)) * 200.0
        self.remaining = max(self.remaining - 1, 0)
        angle, velocity, forces = (
            samples.angle.copy(),
            samples.velocity.copy(),
            samples.forces.copy(),
        )
        angle[:], velocity[:] = 0.02, 0.0
        if self.place in ("hip", "knee") and self.remaining:
            j, sign = (0, 0.4) if self.place == "hip" else (1, -0.5)
            angle[0, j], velocity[0, j] = 0.02 + sign * push, sign * speed
        elif self.place in CUFFS:
            sign = -1.0 if "forward" in self.asked else 1.0
            forces[0, CUFFS.index(self.place), 1] += 60.0 * sign * push
        return replace(samples, angle=angle, velocity=velocity, forces=forces)


@pytest.fixture
def hand(monkeypatch):
    """A person at the rig that is served, who moves it in its samples."""
    person, run = Hand(), Plant.run
    monkeypatch.setattr(Plant, "run", lambda *given: person.on(run(*given)))
    monkeypatch.setattr(by_hand, "LOOK_S", 0.0)
    monkeypatch.setattr(by_hand, "STILL_S", 0.02)
    monkeypatch.setattr(by_hand, "PATIENCE_S", 2.0)
    return person


def findings_of(report):
    return "\n".join(map(str, report.findings))


def test_a_right_rig_that_is_moved_by_hand_has_no_findings(checked, hand):
    report = checked(options={"operator": hand})
    assert findings_of(report) == ""
    assert [prompt.partition(":")[0] for prompt in hand.prompts[1:]] == ["hip", "knee", *CUFFS]


def test_swapped_drives_are_detected_by_which_angle_moves(checked, hand):
    swapped = {
        'joint = "hip"\nunit = 1\nmap = "servo"': 'joint = "hip"\nunit = 2\nmap = "servo"',
        'joint = "knee"\nunit = 2\nmap = "servo"': 'joint = "knee"\nunit = 1\nmap = "servo"',
    }
    findings = findings_of(checked(options={"operator": hand}, believed=swapped))
    assert (
        "drive hip: the hip was moved, but the angle of drive knee changed, by +0.4 rad" in findings
    )
    assert (
        "the two are swapped; exchange host, port and unit of the two in the rig file" in findings
    )


def test_a_wrong_sign_is_detected_by_the_direction(checked, hand):
    findings = findings_of(
        checked(options={"operator": hand}, believed={ANGLE: ANGLE.replace("1e-6", "-1e-6")})
    )
    assert (
        "drive hip: its angle went down (-0.4 rad) when the hip went forward; expected up"
        in findings
    )
    assert re.search(
        r"drive knee: its angle went up \(\+0\.[45]\d* rad\) when the knee went into flexion",
        findings,
    )
    assert "change the sign of map.drive.servo.read.angle.scale" in findings
    assert "velocity is -" in findings


def test_radians_taken_for_degrees_are_detected_by_the_distance(checked, hand):
    findings = findings_of(
        checked(options={"operator": hand}, believed={ANGLE: ANGLE.replace('"rad"', '"deg"')})
    )
    assert re.search(r"drive hip: its angle changed by \+0\.00[67]\d* rad in that motion", findings)
    assert 'with unit = "rad" it would be plausible: correct map.drive.servo.read.angle' in findings


def test_a_force_of_the_wrong_sign_and_swapped_cuffs_are_detected_by_a_push(checked, hand):
    believed = {
        FORCE_Y: FORCE_Y.replace("unit", "scale = -1.0, unit"),
        'cuff = "shank_front"\nunit = 13': 'cuff = "shank_front"\nunit = 14',
        'cuff = "shank_back"\nunit = 14': 'cuff = "shank_back"\nunit = 13',
    }
    findings = findings_of(checked(options={"operator": hand}, believed=believed))
    assert "sensor thigh_front: force_y went up" in findings
    assert "change the sign of map.sensor.force.read.force_y.scale" in findings
    assert (
        "sensor shank_front: shank_front was pressed, but sensor shank_back measured it" in findings
    )


def test_a_leg_that_is_not_moved_is_not_awaited_for_ever(checked, hand, monkeypatch):
    hand.does = False
    monkeypatch.setattr(by_hand, "PATIENCE_S", 0.2)
    findings = findings_of(checked(options={"operator": hand}))
    assert "drive hip: no angle changed when the hip was to be moved; was it?" in findings
    assert "sensor thigh_front: no force of any cuff changed by more than" in findings
