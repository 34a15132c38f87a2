"""Somebody is moved only by a rig that has limits of their own, and watches the forces on them."""

import pytest

from pipelines.acquisition.preconditions.human_interlock import refuse_unguarded, unmonitored
from pipelines.errors import SettingsError
from pipelines.settings import datasets
from pipelines.settings.rig import load_rig


@pytest.fixture
def lab(tmp_path):
    """Load the template of a real rig with changes."""

    def load(*changes):
        text = (datasets() / "rigs" / "lab.toml").read_text()
        for old, new in changes:
            assert old in text
            text = text.replace(old, new)
        path = tmp_path / "rig.toml"
        path.write_text(text)
        return load_rig(path)

    return load


def test_a_rig_with_limits_of_a_persons_own_moves_a_person(lab):
    refuse_unguarded(lab(), 200.0)


@pytest.mark.parametrize(
    ("line", "key"),
    [
        ("speed_rad_s = 0.5\ntorque_nm = 20.0", "drive[0].with_human.speed_rad_s"),
        ("torque_nm = 15.0", "drive[1].with_human.torque_nm"),
        ("cuff_force_n = 60.0", "safety.with_human.cuff_force_n"),
    ],
)
def test_a_limit_that_is_an_empty_machines_is_refused(lab, line, key):
    with pytest.raises(SettingsError, match=r"missing; a run with_human needs") as refused:
        refuse_unguarded(lab((line, "")), 200.0)
    assert str(refused.value).startswith(key)


def test_a_cuff_that_is_hardly_ever_read_is_refused(lab):
    with pytest.raises(
        SettingsError,
        match=r"sensor\[0\]\.every: found 100, which is 0\.5 s at 200 Hz; expected a force",
    ):
        refuse_unguarded(lab(("every = 4", "every = 100")), 200.0)


def test_a_drive_that_does_not_say_whether_it_is_enabled_is_warned_of(lab):
    assert unmonitored(lab()) == []
    (warning,) = unmonitored(
        lab(("enabled_mask = 0x006F", "enabled_mask = 0x0000"), ("enabled_value = 0x0027", ""))
    )
    assert "no enabled_mask for the drive of hip and knee" in warning
    assert "0.1 rad" in warning


def test_a_drive_whose_faults_are_not_read_gives_a_warning(lab):
    (warning,) = unmonitored(
        lab(
            ("fault_mask = 0x0008", "fault_mask = 0x0000"),
            ('faults = { 3 = "fault, see the error code at register 30" }', ""),
        )
    )
    assert "no fault_mask for the drive of hip and knee" in warning
