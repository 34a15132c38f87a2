"""A limit beyond what a register can tell would never be seen broken."""

import pytest

from pipelines.errors import SettingsError
from pipelines.settings import datasets
from pipelines.settings.rig import load_rig

ANGLE = 'angle = { address = 104, type = "int32", scale = 1e-6, unit = "rad" }'
CURRENT = 'current = { address = 108, type = "int32", scale = 0.1, unit = "mA" }'
VELOCITY = 'velocity = { address = 106, type = "int32", scale = 1e-5, unit = "rad/s" }'
FORCE = 'force_y = { address = 104, type = "float32", unit = "N" }'


@pytest.mark.parametrize(
    ("register", "old", "new", "tells"),
    [
        (
            FORCE,
            'type = "float32"',
            'type = "int16", scale = 0.001',
            "force_y: an int16 of this scale tells -32.77 to",
        ),
        (
            FORCE,
            'type = "float32"',
            'type = "uint16", scale = 0.1',
            "force_y: an uint16 of this scale tells 0 to 6554",
        ),
        (
            ANGLE,
            'type = "int32", scale = 1e-6',
            'type = "int16", scale = 1e-5',
            "angle: an int16 of this scale tells",
        ),
        (ANGLE, "int32", "uint32", "read.angle: an uint32 of this scale tells 0 to 4295"),
        (CURRENT, 'type = "int32"', 'type = "int16"', "expected more than -12.5 to 12.5"),
        (
            VELOCITY,
            'type = "int32"',
            'type = "int16"',
            "velocity: an int16 of this scale tells -0.3277 to 0.3277",
        ),
    ],
)
def test_a_register_that_ends_before_a_limit_is_refused(tmp_path, register, old, new, tells):
    text = (datasets() / "rigs" / "plain.toml").read_text()
    assert register in text
    path = tmp_path / "rig.toml"
    path.write_text(text.replace(register, register.replace(old, new)))
    with pytest.raises(
        SettingsError, match="correct its type or scale, or lower the limits"
    ) as refused:
        load_rig(path)
    assert tells in str(refused.value)
