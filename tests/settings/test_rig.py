import pytest

from pipelines.errors import SettingsError
from pipelines.settings import datasets
from pipelines.settings.rig import load_rig

RIGS = datasets() / "rigs"


@pytest.mark.parametrize("path", sorted(RIGS.glob("*.toml")), ids=lambda path: path.stem)
def test_every_shipped_rig_can_be_used(path):
    assert load_rig(path).name == path.stem


def test_the_public_part_of_a_rig_does_not_hold_its_plant():
    public = str(load_rig(RIGS / "default.toml").public())
    assert "servo" in public
    for secret in ("plant", "sealed", "inertial", "coulomb"):
        assert secret not in public


def test_a_virtual_rig_knows_its_geometry_and_its_loops():
    rig = load_rig(RIGS / "default.toml")
    assert rig.known_geometry()["shank_cuff_distance_m"] == 0.22
    assert rig.known_controllers()["hip"] == {
        "type": "pd",
        "kp_nm_rad": 1500.0,
        "kd_nm_s_rad": 120.0,
        "rate_hz": 1000.0,
        "limit_nm": 200.0,
    }


@pytest.mark.parametrize(
    ("old", "new", "message"),
    [
        (
            "gear_ratio = 100.0",
            "gear_rato = 100.0",
            "drive[0].gear_rato: unknown key; did you mean gear_ratio? (and 1 more)",
        ),
        ("unit = 2", "unit = 400", "drive[1].unit: found 400, expected less than or equal to 255"),
        ("unit = 2", "unit = 1", "unit: two devices have 127.0.0.1:502 unit 1; correct one"),
        (
            'map = "servo"',
            'map = "servos"',
            "drive[0].map: found 'servos', expected a table below [map.drive]: servo",
        ),
        (
            'cuff = "thigh_back"',
            'cuff = "thigh_front"',
            "sensor: found two sensors at thigh_front, expected one; correct their cuffs",
        ),
        (
            'scale = 1e-6, unit = "rad" }\nvelocity',
            'scale = 1e-6, unit = "A" }\nvelocity',
            ("map.drive.servo: read.angle.unit: found 'A', expected rad or mrad or deg"),
        ),
        (
            "address = 106",
            "address = 105",
            ("map.drive.servo: read.velocity: register 105 is part of angle too"),
        ),
        (
            "address = 113",
            "address = 400",
            (
                "map.drive.servo: write.function: found 23, which reads one request, but read"
                " takes 2; set write.function = 16"
            ),
        ),
        (
            "control = { address = 202",
            "control = { address = 204",
            (
                "map.drive.servo: write: register 202 between 200 and 204 has no name,"
                " expected a block without gaps; set write.function = 16, which writes its"
                " parts one after another"
            ),
        ),
        (
            "[map.drive.servo.write]\n",
            "[map.drive.servo.write]\nfunction = 6\n",
            (
                "map.drive.servo: write.function: found 6, which writes one register, but reference"
                " takes more; the drive would follow half a value. Set function = 16, or use a"
                " set-point of one register"
            ),
        ),
        (
            'scale = 0.1, unit = "mA"',
            'scale = 0.0, unit = "mA"',
            ("map.drive.servo.read.current: scale: found 0, expected units per count"),
        ),
        (
            "angle_rad = [-0.35, 1.75]",
            "angle_rad = [1.75, -0.35]",
            "drive[0]: angle_rad: found [1.75, -0.35], expected the lowest angle first; swap them",
        ),
        (
            'map = "servo"',
            'map = "servo"\nline = "leg"',
            "line: found 'leg' at unit 1, expected a table below [line]: there is none",
        ),
        (
            "enable = 0x000F",
            "enable = 0x1000F",
            ("map.drive.servo: enable: found 0x1000F, but write.control is a uint16"),
        ),
        (
            "fault_mask = 0x0008",
            "fault_mask = 0x10000",
            ("map.drive.servo: fault_mask: found 0x10000, but read.status is a uint16"),
        ),
        (
            'control = { address = 202, type = "uint16"',
            'control = { address = 202, type = "int16"',
            (
                "map.drive.servo: write.control: found int16 with scale 1 and offset 0, expected"
                " uint16, uint32 or uint64 without scale or offset"
            ),
        ),
        (
            'scale = 1e-6, unit = "rad" }\ncontrol',
            'scale = 1e-10, unit = "rad" }\ncontrol',
            (
                "map.drive.servo.write.reference: cannot hold -0.35 to 1.75 rad, the hip's limits;"
                " correct its type or scale"
            ),
        ),
        (
            'scale = 1e-6, unit = "rad" }\ncontrol',
            'scale = 5.0, unit = "deg" }\ncontrol',
            (
                "map.drive.servo.write.reference: one count is 0.0873 rad, expected at most 0.025"
                " rad, a quarter of safety.following_error_rad or of the hip's range; correct its"
                " scale"
            ),
        ),
        (
            "ramp_s = 3.0",
            "ramp_s = 1e9",
            "safety.ramp_s: found 1000000000.0, expected less than or equal to 60",
        ),
        (
            'sequence = { address = 100, type = "uint32"',
            'sequence = { address = 100, type = "float32"',
            (
                "map.drive.servo: read.sequence: found float32 with scale 1 and offset 0, expected"
                " uint16, uint32 or uint64 without scale or offset"
            ),
        ),
        (
            'sequence = { address = 100, type = "uint32"',
            'sequence = { address = 100, type = "uint32", scale = 0.5',
            (
                "map.drive.servo: read.sequence: found uint32 with scale 0.5 and offset 0, expected"
                " uint16, uint32 or uint64 without scale or offset"
            ),
        ),
        (
            'control = { address = 202, type = "uint16" }',
            (
                'control = { address = 202, type = "uint16" }\n'
                'heartbeat = { address = 203, type = "uint16", scale = 1e-6 }'
            ),
            (
                "map.drive.servo: write.heartbeat: found uint16 with scale 1e-06 and offset 0,"
                " expected uint16, uint32 or uint64 without scale or offset"
            ),
        ),
        (
            'unit = "us"',
            'scale = -1.0, unit = "us"',
            (
                "map.drive.servo: read.time.scale: found -1, expected a clock "
                "that goes forward; turn its sign"
            ),
        ),
        (
            'scale = 0.1, unit = "mA"',
            'scale = 0.1, offset = 1e308, unit = "mA"',
            (
                "map.drive.servo.read.current."
                "offset: found 1e+308, expected less than or equal to 1000000000000"
            ),
        ),
        (
            "[plant]\n",
            "[controller.knee]\nlimit_nm = 110.0\n[plant]\n",
            (
                "torque_nm: found 110 of the knee, expected less than its controller.limit_nm"
                " (110), at which the drive saturates; lower it"
            ),
        ),
        (
            "following_error_rad = 0.1\n",
            "following_error_rad = 0.2\n",
            (
                "safety: with_human.following_error_rad: found 0.2, expected at most"
                " following_error_rad (0.15); with a wearer a limit may only be"
                " tighter"
            ),
        ),
        (
            "[map.drive.servo]\n",
            "[line.leg]\ntransport = 'tcp'\n[map.drive.servo]\n",
            'line.leg: no device is on it; remove it, or give one line = "leg"',
        ),
        (
            "[map.drive.servo]\n",
            "[line.leg]\ntransport = 'rs485'\n[map.drive.servo]\n",
            (
                "line.leg.transport: found "
                "'rs485', expected one of 'tcp', 'rtu', 'rtu_over_tcp', 'tls'"
            ),
        ),
        (
            "[map.drive.servo]\n",
            "[line.leg]\nhost = 'leg'\n[map.drive.servo]\n",
            "line.leg.transport: missing; add it",
        ),
        (
            "unit = 2\n",
            "unit = 2\nline = 'leg'\nport = 502\n",
            ("drive[1]: port: found together with line = 'leg'; remove one"),
        ),
        (
            "[map.drive.servo]\n",
            "[line.leg]\ntransport = 'tls'\nkey = 'a.key'\n[map.drive.servo]\n",
            "line.leg: certificate and key belong together; give both or neither",
        ),
        (
            "[map.drive.servo]\n",
            "[map.drive.servo]\nfaults = { 5 = 'hot' }\n",
            (
                "map.drive.servo: faults: bit 5 is not "
                "one of fault_mask 0x0008; add 0x0020 to the mask, or leave the name out"
            ),
        ),
        (
            "speed_rad_s = 2.2",
            "speed_rad_s = 3.2",
            (
                "drive[0]: with_human.speed_rad_s: found 3.2, expected at most "
                "speed_rad_s (3); with a wearer a limit may only be tighter"
            ),
        ),
        (
            "[drive.with_human]",
            "[drive.with_human]\nangle_rad = [-0.4, 1.0]",
            (
                "drive[0]: with_human.angle_rad: found [-0.4, 1], expected within angle_rad [-0.35,"
                " 1.75]; with a wearer a limit may only be tighter"
            ),
        ),
        (
            "cuff_force_n = 250.0",
            "cuff_force_n = 500.0",
            (
                "safety: with_human.cuff_force_n: found 500, expected at most "
                "cuff_force_n (400); with a wearer a limit may only be tighter"
            ),
        ),
        (
            "enabled_value = 0x0001",
            "enabled_value = 0x0003",
            (
                "map.drive.servo: enabled_value: found 0x0003, expected "
                "bits of enabled_mask 0x0001 only; correct one of them"
            ),
        ),
        (
            "halt = 0x010F",
            "halt = 0x000F",
            (
                "map.drive.servo: enable and halt: both are 0x000F, expected different "
                "control words; correct one"
            ),
        ),
        (
            'joint = "knee"',
            'joint = "hip"',
            "drive: found hip, hip, expected one for the hip, then one for the knee",
        ),
        (
            "enabled_value = 0x0001",
            "#",
            (
                "map.drive.servo: enabled_value: missing with enabled_mask 0x0001; add the "
                "value of these bits while the drive is enabled, from its manual"
            ),
        ),
        (
            "fault_mask = 0x0008",
            "fault_mask = 0x0009",
            (
                "map.drive.servo: fault_mask: found 0x0009, but 0x0001 of it is in enabled_value"
                " 0x0001. An enabled drive has no fault"
            ),
        ),
        (
            (
                "enabled_mask = 0x0001                  # bits that show whether the drive is"
                " enabled ...\nenabled_value = 0x0001"
            ),
            "enabled_mask = 0x0008\nenabled_value = 0x0000",
            (
                "map.drive.servo: enabled_mask: found 0x0008, all of it in fault_mask 0x0008."
                " Expected a bit that no fault sets"
            ),
        ),
        (
            "angle_margin_rad = 0.02",
            "angle_margin_rad = 1.05",
            (
                "safety.angle_margin_rad: found 1.05, expected less "
                "than 1.05, half of the hip's angle_rad; lower it"
            ),
        ),
        (
            "thigh_length_m = 0.38952",
            "thigh_length_m = 38952",
            "plant.thigh_length_m: found 38952, expected less than or equal to 5",
        ),
        (
            "[plant]\n",
            "[geometry]\nthigh_length_m = 389.52\n[plant]\n",
            "geometry.thigh_length_m: found 389.52, expected less than or equal to 5",
        ),
    ],
)
def test_a_bad_rig_file_is_refused_in_one_line_with_the_keys_path(tmp_path, old, new, message):
    text = (RIGS / "plain.toml").read_text()
    assert old in text
    path = tmp_path / "rig.toml"
    path.write_text(text.replace(old, new, 1))
    with pytest.raises(SettingsError) as caught:
        load_rig(path)
    assert str(caught.value) == f"{path}: {message}"


def test_active_faults_are_named_and_those_without_a_name_numbered():
    servo = (
        load_rig(RIGS / "lab.toml")
        .map.drive["servo"]
        .model_copy(update={"fault_mask": 0x00A8, "faults": {3: "over-current", 7: "too hot"}})
    )
    assert servo.active_faults(0x0107) == ""
    assert servo.active_faults(0xFFFF) == "0x00A8: over-current, bit 5, too hot"
    assert servo.model_copy(update={"faults": {}}).active_faults(0x0008) == "0x0008"


def test_a_recording_does_not_hold_the_paths_of_keys(tmp_path):
    line = "[line.leg]\ntransport = 'tls'\nca = 'secret/ca.pem'\n"
    text = (RIGS / "plain.toml").read_text().replace('map = "servo"', 'map = "servo"\nline = "leg"')
    (tmp_path / "rig.toml").write_text(
        text.replace("[map.drive.servo]\n", line + "[map.drive.servo]\n")
    )
    rig = load_rig(tmp_path / "rig.toml")
    assert rig.line["leg"].ca == tmp_path / "secret" / "ca.pem"
    assert rig.public()["line"]["leg"]["transport"] == "tls"
    assert "secret" not in str(rig.public())


def test_the_tighter_limits_are_in_force_with_a_wearer():
    rig = load_rig(RIGS / "plain.toml")
    alone, human = rig.in_force("exo_alone"), rig.in_force("with_human")
    assert [drive.speed_rad_s for drive in alone.drive] == [3.0, 3.5]
    assert alone.safety.cuff_force_n == 400.0
    assert [drive.speed_rad_s for drive in human.drive] == [2.2, 2.2]
    assert [drive.torque_nm for drive in human.drive] == [100.0, 60.0]
    assert [drive.angle_rad for drive in human.drive] == [drive.angle_rad for drive in rig.drive]
    assert human.safety.cuff_force_n == 250.0
    assert human.in_force("exo_alone") == human  # no others are left
