"""Runs on drives that know other functions, or fewer registers a request, bring the same motion."""

import numpy as np
import pytest

READ, WRITE = "[map.drive.servo.read]", "[map.drive.servo.write]\n"
FORCES = "[map.sensor.force.read]\n"
REAL = {"[plant]\n": "[plant]\nsample_rate_hz = 25.0\n"}
SHORT_WORDS = {
    "enable = 0x000F\n": "own_scale = true\nenable = 0x000F\n",
    'reference = { address = 200, type = "int32", scale = 1e-6, unit = "rad" }': (
        'reference = { address = 200, type = "int16", scale = 1e-4, unit = "rad" }'
    ),
}


@pytest.mark.parametrize(
    ("replace", "functions"),
    [
        ({WRITE: f"{WRITE}function = 16\n"}, {3, 16}),
        ({WRITE: f"{WRITE}function = 6\n", **SHORT_WORDS}, {3, 6}),
        pytest.param(
            {
                READ: f"{READ}\nfunction = 4\nmost_words = 8",
                WRITE: f"{WRITE}function = 16\n",
            },
            {4, 16},
            marks=pytest.mark.slow,
        ),
    ],
    ids=["FC16 and FC03", "FC06 for each register", "FC04 of 8 registers, FC16"],
)
def test_a_run_without_function_23_is_recorded_and_the_leg_follows(
    record, any_rate, replace, functions
):
    used = set()

    def note(device, function, written):
        used.add(function)

    table = record(
        fault=note,
        shipped="real_time",
        replace={**REAL, **replace},
        rate_hz=25.0,
        watchdog_s=0.95,
        duration_s=1.0,
        heartbeat_s=4.0,
    )
    assert used == functions
    frame = table.frame
    assert len(frame) >= 15, "even on a busy computer"
    assert np.ptp(frame["hip_angle_rad"]) > 0.1
    error = frame["hip_reference_rad"] - frame["hip_angle_rad"]
    assert np.sqrt(np.mean(error**2)) < 0.05
