"""A rig file whose limits are too wide to protect a wearer is refused."""

import re
from pathlib import Path

import pytest

from pipelines.errors import SettingsError
from pipelines.settings import datasets
from pipelines.settings.rig import load_rig
from pipelines.settings.rig.devices import HumanDriveSettings
from pipelines.settings.rig.safety import HumanSafetySettings
from pipelines.settings.rig.safety_bounds import DRIVE, SAFETY

ROOT = Path(__file__).parents[2]
LAB = (datasets() / "rigs" / "lab.toml").read_text()


def test_every_limit_that_stops_a_run_is_bounded_and_on_the_rigs_page():
    of_safety = {*HumanSafetySettings.model_fields, "watchdog_s"}
    of_drives = set(HumanDriveSettings.model_fields) - {"angle_rad"}  # a turn bounds angles
    assert (of_safety - set(SAFETY), of_drives - set(DRIVE)) == (set(), set())
    page = (ROOT / "docs" / "rig.md").read_text(encoding="utf-8").partition("### Stops")[2]
    stops = page.partition("### ")[0]
    keys = [*(f"safety.{name}" for name in of_safety), *of_drives, "angle_rad"]
    assert [key for key in keys if f"`{key}`" not in stops] == []


def loaded(tmp_path, key, value, text=LAB):
    changed, count = re.subn(
        rf"^{key} = [^#\n]*", f"{key} = {value} ", text, count=1, flags=re.MULTILINE
    )
    assert count, key
    path = tmp_path / "rig.toml"
    path.write_text(changed)
    return load_rig(path)


@pytest.mark.parametrize(
    ("key", "value", "message"),
    [
        ("watchdog_s", 3600.0, "safety.watchdog_s: found 3600, expected at most 1"),
        (
            "following_error_rad",
            1e9,
            "safety.following_error_rad: found 1e+09, expected at most 0.5",
        ),
        ("cuff_force_n", 1e9, "safety.cuff_force_n: found 1e+09, expected at most 2000"),
        ("control_s", 1e9, "safety.control_s: found 1e+09, expected at most 30"),
        ("connect_s", 1e9, "safety.connect_s: found 1e+09, expected at most 60"),
        ("speed_rad_s", 1e6, "drive[0].speed_rad_s: found 1e+06, expected at most 20"),
        ("torque_nm", 1e9, "torque_nm: found 1e+09 "),
        (
            "angle_rad",
            "[-1000.0, 1.0]",
            "drive[0].angle_rad: found -1000, expected radians, at most one turn",
        ),
        (
            "deceleration_rad_s2",
            1e-6,
            "safety.deceleration_rad_s2: found 1e-06, expected at least 1. To stop from 1 rad/s"
            " (exo_alone) the hip takes 1e+06 s and 5e+05 rad",
        ),
        ("deceleration_rad_s2", 0.9, "safety.deceleration_rad_s2: found 0.9"),
    ],
)
def test_a_limit_too_wide_to_protect_a_wearer_is_refused(tmp_path, key, value, message):
    with pytest.raises(SettingsError) as caught:
        loaded(tmp_path, key, value)
    assert message in str(caught.value)


def test_a_stop_that_leads_beyond_all_angles_of_a_joint_is_refused_though_it_is_short(tmp_path):
    text = LAB.replace("speed_rad_s = 1.0", "speed_rad_s = 6.0")
    with pytest.raises(
        SettingsError, match=r"from 6 rad/s \(exo_alone\) the hip takes 0.75 s and 2.25 rad"
    ):
        loaded(tmp_path, "deceleration_rad_s2", 8.0, text)


def test_a_virtual_rig_has_no_wearer_and_no_bounds(tmp_path):
    text = (datasets() / "rigs" / "plain.toml").read_text()
    assert loaded(tmp_path, "watchdog_s", 3600.0, text).safety.watchdog_s == 3600.0
