import pytest

from pipelines.errors import SettingsError
from pipelines.settings import datasets
from pipelines.settings.rig import load_rig

RIGS = datasets() / "rigs"


@pytest.mark.parametrize("path", sorted(RIGS.glob("*.toml")), ids=lambda path: path.stem)
def test_every_shipped_rig_can_be_used(path):
    assert load_rig(path).name == path.stem


def test_what_a_rig_tells_of_itself_does_not_hold_its_plant():
    told = str(load_rig(RIGS / "default.toml").public())
    assert "servo" in told
    for secret in ("plant", "sealed", "inertial", "coulomb"):
        assert secret not in told


def test_a_virtual_rig_knows_its_geometry_and_its_loops():
    rig = load_rig(RIGS / "default.toml")
    assert rig.known_geometry()["shank_cuff_distance_m"] == 0.22
    assert rig.known_controllers()["hip"] == {
        "type": "pd", "kp_nm_rad": 1500.0, "kd_nm_s_rad": 120.0, "rate_hz": 1000.0, "limit_nm": 200.0,
    }  # fmt: skip


@pytest.mark.parametrize(
    ("old", "new", "message"),
    [
        ("gear_ratio = 100.0", "gear_rato = 100.0", "drive[0].gear_rato: unknown key; did you mean gear_ratio? "
         "(and 1 more)"),
        ("unit = 2", "unit = 400", "drive[1].unit: found 400, expected less than or equal to 247"),
        ("unit = 2", "unit = 1", "unit: 127.0.0.1:502 unit 1 stands for two devices; correct one"),
        ('map = "servo"', 'map = "servos"', "drive[0].map: found 'servos', expected a table below [map.drive]: servo"),
        ('cuff = "thigh_back"', 'cuff = "thigh_front"', "sensor: found two sensors at thigh_front, expected one; "
         "correct their cuffs"),
        ('scale = 1e-6, unit = "rad" }\nvelocity', 'scale = 1e-6, unit = "A" }\nvelocity',
         "map.drive.servo: read.angle.unit: found 'A', expected rad or mrad or deg; correct the unit"),
        ("address = 106", "address = 105", "map.drive.servo: read.velocity: register 105 is part of angle too; correct "
         "one address"),
        ("address = 113", "address = 400", "map.drive.servo: read: spans 301 registers (100 to 400), expected at most "
         "125, which is what one Modbus exchange carries"),
        ("scale = 0.1, unit = \"mA\"", "scale = 0.0, unit = \"mA\"", "map.drive.servo.read.current: scale: found 0, "
         "expected units per count; every value would be the offset"),
        ("angle_rad = [-0.35, 1.75]", "angle_rad = [1.75, -0.35]", "drive[0]: angle_rad: found [1.75, -0.35], expected "
         "the lowest angle first; swap them"),
        ('joint = "knee"', 'joint = "hip"', "drive: found hip, hip, expected one for the hip, then one for the knee"),
    ],
)  # fmt: skip
def test_a_bad_rig_file_is_refused_in_one_line_with_the_keys_path(tmp_path, old, new, message):
    text = (RIGS / "plain.toml").read_text()
    assert old in text
    path = tmp_path / "rig.toml"
    path.write_text(text.replace(old, new, 1))
    with pytest.raises(SettingsError) as caught:
        load_rig(path)
    assert str(caught.value) == f"{path}: {message}"
