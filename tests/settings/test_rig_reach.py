"""A value beyond a limit must be within the range of its register."""

import pytest

from pipelines.errors import SettingsError
from pipelines.settings import datasets
from pipelines.settings.rig import load_rig

ANGLE = 'angle = { address = 104, type = "int32", scale = 1e-6, unit = "rad" }'
CURRENT = 'current = { address = 108, type = "int32", scale = 0.1, unit = "mA" }'
VELOCITY = 'velocity = { address = 106, type = "int32", scale = 1e-5, unit = "rad/s" }'
FORCE = 'force_y = { address = 104, type = "float32", unit = "N" }'


@pytest.mark.parametrize(
    ("register", "old", "new", "message"),
    [
        (
            FORCE,
            'type = "float32"',
            'type = "int16", scale = 0.001',
            "force_y: this int16 can represent -32.77 to",
        ),
        (
            FORCE,
            'type = "float32"',
            'type = "uint16", scale = 0.1',
            "force_y: this uint16 can represent 0 to 6554",
        ),
        (
            ANGLE,
            'type = "int32", scale = 1e-6',
            'type = "int16", scale = 1e-5',
            "angle: this int16 can represent",
        ),
        (ANGLE, "int32", "uint32", "read.angle: this uint32 can represent 0 to 4295"),
        (CURRENT, 'type = "int32"', 'type = "int16"', "the hip's limits are -12.5 to 12.5 A"),
        (
            VELOCITY,
            'type = "int32"',
            'type = "int16"',
            "velocity: this int16 can represent -0.3277 to 0.3277 rad/s",
        ),
    ],
)
def test_a_register_that_ends_before_a_limit_is_refused(tmp_path, register, old, new, message):
    text = (datasets() / "rigs" / "plain.toml").read_text()
    assert register in text
    path = tmp_path / "rig.toml"
    path.write_text(text.replace(register, register.replace(old, new)))
    with pytest.raises(
        SettingsError, match="correct its type or scale, or lower the limits"
    ) as refused:
        load_rig(path)
    assert message in str(refused.value)
