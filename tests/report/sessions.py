"""Sessions as stages would write them, small and quick: the numbers are made up, but every file
keeps its contract."""

import json

import numpy as np
import pandas as pd

from pipelines.contracts import (
    CANDIDATES,
    HIP_AND_KNEE,
    PARAMETERS,
    RECORDING,
    RESIDUALS,
    SIMULATION,
    TRAJECTORY,
    Joint,
    describe,
)
from pipelines.contracts.verdict import Verdict

LEG = HIP_AND_KNEE
AXIS = (Joint("axis", "prismatic"),)
RUN = "with_human_validate.parquet"


def named(joints):
    return [{"name": joint.name, "kind": joint.kind} for joint in joints]


def motion_of(joints, time):
    """Angle, velocity, acceleration and torque of each joint: sines of different phase."""
    states = {}
    for j, joint in enumerate(joints):
        angle = 0.4 * np.sin(2 * time + j) - 0.3 * j
        torque = 12 * np.sin(2 * time + j + 0.4)
        states[joint.name] = (
            angle,
            0.8 * np.cos(2 * time + j),
            -1.6 * np.sin(2 * time + j),
            torque,
        )
    return states


def write_recording(folder, joints=LEG, seconds=20.0, rate_hz=200.0, name=RUN, **metadata):
    time = np.arange(round(seconds * rate_hz)) / rate_hz
    columns = {"time_s": time}
    for joint in joints:
        angle, _, _, torque = motion_of(joints, time)[joint.name]
        columns |= {joint.column("angle"): angle, joint.column("torque"): torque}
    told = (
        {
            "run": "with_human",
            "purpose": "validate",
            "sample_rate_hz": rate_hz,
            "joints": named(joints),
        }
        | describe()
        | metadata
    )
    RECORDING.write(folder / "recordings" / name, pd.DataFrame(columns), told)
    return folder / "recordings" / name


def write_parameters(folder, joints=LEG, extended=False, shift=0.0, inputs=()):
    rows = [
        ("rigid_body", f"X{i + 1}", None, "with_human", 2.0 + i + shift, "kg·m²") for i in range(2)
    ]
    rows += [
        ("friction", "coulomb", joint.name, None, 5.0 + shift, joint.unit("torque"))
        for joint in joints
    ]
    if extended:
        rows.append(
            ("cogging", "amplitude", joints[-1].name, None, 1.5 + shift, joints[-1].unit("torque"))
        )
    frame = pd.DataFrame(rows, columns=["effect", "name", "joint", "run", "value", "unit"])
    frame["symbol"], frame["std_error"] = frame["name"], 0.01
    frame["ci95_low"], frame["ci95_high"] = frame["value"] - 0.025, frame["value"] + 0.025
    frame["step"] = "inertia"
    about = {
        "joints": named(joints),
        "covariance": (1e-4 * np.eye(len(frame))).tolist(),
    } | describe(inputs)
    path = folder / ("diagnosed" if extended else "identified") / "parameters.parquet"
    PARAMETERS.write(path, frame, about)
    return path


def write_residuals(folder, joints=LEG, seconds=20.0, inputs=()):
    time = np.arange(0, seconds, 0.025)
    rng, parts = np.random.default_rng(0), []
    for model, left in (("baseline", 1.0), ("extended", 0.3)):
        columns = {
            "file": RUN,
            "run": "with_human",
            "purpose": "validate",
            "segment": 0,
            "time_s": time,
            "model": model,
            "scored": np.sin(2 * time) ** 2 < 0.95,
        }
        for joint in joints:
            angle, speed, acceleration, torque = motion_of(joints, time)[joint.name]
            residual = left * np.sin(20 * angle) + 0.2 * rng.standard_normal(len(time))
            values = (angle, speed, acceleration, torque, torque - residual, residual)
            quantities = ("angle", "velocity", "acceleration", "torque", "predicted", "residual")
            columns |= {
                joint.column(name): value for name, value in zip(quantities, values, strict=True)
            }
        parts.append(pd.DataFrame(columns))
    RESIDUALS.write(
        folder / "diagnosed" / "residuals.parquet",
        pd.concat(parts, ignore_index=True),
        {"joints": named(joints)} | describe(inputs),
    )


def write_candidates(folder, joints=LEG, reason="nothing smaller explains as much"):
    rows = [
        (
            1,
            ["cogging@" + joints[-1].name],
            [{"name": "amplitude", "value": 1.5, "unit": "N·m"}],
            "named",
            reason,
        ),
        (2, ["parallel_spring@" + joints[-1].name], [], "rejected", "adds too little"),
    ]
    frame = pd.DataFrame(rows, columns=["rank", "causes", "parameters", "verdict", "reason"])
    for joint in joints:
        frame[joint.column("rmse_before")], frame[joint.column("rmse_after")] = 0.72, 0.31
    frame["train_score"], frame["probability"] = 100.0, 0.9
    frame["gain_nm"], frame["gain_low_nm"], frame["gain_high_nm"] = 0.41, 0.37, 0.45
    CANDIDATES.write(
        folder / "diagnosed" / "candidates.parquet", frame, {"joints": named(joints)} | describe()
    )


def verdict_of(joints=LEG, **changes):
    last = joints[-1].name
    of_joints = {joint.name: 0.7182818 + 0.1 * j for j, joint in enumerate(joints)}
    reduced = {name: 0.3141593 for name in of_joints}
    told = {
        "contract": "verdict/1",
        "status": "explained",
        "summary": f"Missing from the simulation: cogging at the {last} (probability 0.90).",
        "caveats": [],
        "scoring": {"bandwidth_hz": 17.7, "mask": "|v| < 0.04 rad/s", "samples": 800},
        "noise_floor_nm": {name: 0.2718282 for name in of_joints},
        "baseline_rmse_nm": of_joints,
        "extended_rmse_nm": reduced,
        "baseline_rmse_unmasked_nm": of_joints,
        "extended_rmse_unmasked_nm": reduced,
        "baseline_simulation_rmse_rad": {name: 0.0223607 for name in of_joints},
        "extended_simulation_rmse_rad": {name: 0.0141421 for name in of_joints},
        "unexplained": {name: 0.05 for name in of_joints},
        "control": {
            "run": "with_human",
            "controller": {},
            "reason": None,
            "without": {
                "tracking_rmse_rad": {name: 0.0015 for name in of_joints},
                "peak_torque_nm": {name: 33.3 for name in of_joints},
            },
            "with": {
                "tracking_rmse_rad": {name: 0.0017 for name in of_joints},
                "peak_torque_nm": {name: 35.5 for name in of_joints},
            },
        },
        "error_budget": {
            name: {
                "noise_floor": 0.07,
                f"cogging@{last}": 0.4,
                "repeatable_unexplained": 0.04,
                "not_repeatable": 0.006,
            }
            for name in of_joints
        },
        "depends_on": {
            name: [
                {"variable": "angle", "share_before": 0.8, "share_after": 0.1},
                {"variable": "phase", "share_before": 0.8, "share_after": 0.1},
                {"variable": "speed", "share_before": 0.2, "share_after": 0.1},
            ]
            for name in of_joints
        },
        "units": {
            joint.name: {"torque": joint.unit("torque"), "angle": joint.unit("angle")}
            for joint in joints
        },
        "causes": [
            {
                "effect": "cogging",
                "joint": last,
                "side": "drive",
                "probability": 0.9,
                "parameters": [
                    {"name": "amplitude", "value": 1.5, "unit": "N·m", "ci95": [1.4, 1.6]}
                ],
                "gain": {
                    "rmse_reduction_nm": 0.504,
                    "ci95": [0.45, 0.55],
                    "systematic_error_removed": 0.95,
                    "joint": last,
                },
                "indistinguishable_from": [
                    {
                        "effect": "parallel_spring",
                        "joint": last,
                        "why": "both follow the angle",
                        "how_to_separate": "turn it slowly",
                        "probability": 0.1,
                    }
                ],
                "evidence": ["it takes 0.50 of 0.82"],
                "fitted_on_validate": [],
            }
        ],
        "data_faults": [],
        "residual": None,
        "runs": ["with_human"],
        "noise_floor_from": "periods",
    }
    return told | changes


def checked_verdict(joints=LEG, **changes):
    return Verdict.model_validate(verdict_of(joints, **changes))


def decision_of(joints=LEG, ties=("parallel_spring",), law=0.02, nothing=0.03):
    """What a verdict of the decision says besides: cogging at the last joint, and what is tied with
    it."""
    last = joints[-1].name
    effects = ("cogging", *ties)
    # The named cause is twice as probable as each that is tied with it.
    parts = [2.0, *([1.0] * len(ties))]
    each = [(1.0 - nothing - law) * part / sum(parts) for part in parts]
    probability = sum(each)
    words = {effect: f"{effect.replace('_', ' ')} at the {last}" for effect in effects}
    path = [
        ("missing", True, 1.0 - nothing, "something is missing"),
        ("repeats", True, 1.0 - nothing, "something that repeats with the motion"),
        ("joint", last, 1.0 - nothing, f"something at the {last}"),
        ("family", "angle", 1.0 - nothing, f"a law of the {last}'s angle"),
        ("cause", f"cogging@{last}", probability, words["cogging"]),
    ]
    finding = {
        "level": "cause",
        "repeats": True,
        "joint": last,
        "family": "angle",
        "probability": probability,
        "words": words["cogging"],
        "causes": [
            {
                "effect": effect,
                "joint": last,
                "family": "angle",
                "probability": p,
                "words": words[effect],
                "dropped": False,
            }
            for effect, p in zip(effects, each, strict=True)
        ],
        "laws": [
            {
                "law": "angle",
                "joint": last,
                "probability": law,
                "words": f"a law of the {last}'s angle",
            }
        ],
        "path": [
            dict(zip(("level", "value", "probability", "words"), node, strict=True))
            for node in path
        ],
    }
    shares = {
        "rms_nm": 0.7,
        "noise": 0.2,
        "repeats": 0.7,
        "wanders": 0.08,
        "between_runs": 0.02,
        "unsplit": 0.0,
        "with_person_only": 0.1,
    }
    return {
        "findings": [finding],
        "router": {joint.name: dict(shares) for joint in joints},
        "posterior": {
            "nothing_missing": nothing,
            "unlisted": law,
            "causes": {f"{effect}@{last}": p for effect, p in zip(effects, each, strict=True)},
            "laws": {f"law:angle@{last}": law},
        },
    }


def write_verdict(folder, joints=LEG, inputs=(), **changes):
    said = verdict_of(joints, **changes) | {
        "provenance": {"joints": named(joints)} | describe(inputs)
    }
    (folder / "diagnosed").mkdir(parents=True, exist_ok=True)
    (folder / "diagnosed" / "verdict.json").write_text(
        json.dumps(said, ensure_ascii=False), encoding="utf-8"
    )


def write_replay(
    folder, parameters, recording, joints=LEG, seconds=20.0, rate_hz=200.0, off=0.02, spike=None
):
    time = np.arange(round(seconds * rate_hz)) / rate_hz
    columns = {"time_s": time, "window": (time // 1.0).astype(np.int64)}
    for joint in joints:
        angle, speed, _, torque = motion_of(joints, time)[joint.name]
        error = off * (time % 1.0) ** 2
        if spike is not None:
            error[spike] = 1.0
        values = (angle, angle - error, speed, error, torque, np.full(len(time), np.nan))
        quantities = ("reference", "angle", "velocity", "error", "torque", "network")
        columns |= {
            joint.column(name): value for name, value in zip(quantities, values, strict=True)
        }
    about = {
        "joints": named(joints),
        "windows": 2 * int(seconds) - 1,
        "simulation_rmse_rad": {joint.name: off / 5**0.5 for joint in joints},
    }
    path = folder / "simulated" / parameters.parent.name / f"replay-{recording.name}"
    SIMULATION.write(path, pd.DataFrame(columns), about | describe([parameters, recording]))
    return path


def write_loop(folder, parameters, joints=LEG):
    time = np.arange(0, 10.001, 0.001)
    columns = {"time_s": time}
    for joint in joints:
        angle, speed, _, torque = motion_of(joints, time)[joint.name]
        error = 0.01 * np.exp(-time)
        values = (angle, angle - error, speed, error, torque, 0.5 * torque)
        quantities = ("reference", "angle", "velocity", "error", "torque", "network")
        columns |= {
            joint.column(name): value for name, value in zip(quantities, values, strict=True)
        }
    about = {
        "joints": named(joints),
        "plant": {"run": "with_human"},
        "controller": {"type": "rbf", "reference": "gait"},
    }
    path = folder / "simulated" / parameters.parent.name / "rbf.parquet"
    SIMULATION.write(
        path,
        pd.DataFrame(columns),
        about | describe([parameters], {"simulate": {"settled_after_s": 5.0}}),
    )
    gains = {"feedback_gain_nm_s_rad": [100.0, 200.0, 300.0]}
    gains |= {joint.column("error"): [0.02, 0.012, 0.009] for joint in joints}
    pd.DataFrame(gains).to_csv(path.with_name("kv-sweep.csv"), index=False)


def write_trajectory(folder, joints=LEG):
    time = np.arange(0, 10, 0.005)
    columns = {"time_s": time}
    for joint in joints:
        angle, speed, acceleration, _ = motion_of(joints, time)[joint.name]
        columns |= {
            joint.column("angle"): angle,
            joint.column("velocity"): speed,
            joint.column("acceleration"): acceleration,
        }
    margins = [
        {
            "joint": joints[0].name,
            "quantity": "angle",
            "unit": "rad",
            "low": -1.0,
            "high": 1.0,
            "lowest": -0.4,
            "highest": 0.4,
            "margin": 0.6,
        }
    ]
    about = {
        "joints": named(joints),
        "condition": 29.8,
        "log_det": 10.7,
        "margins": margins,
        "standard_errors": {"X1": 0.007},
    }
    TRAJECTORY.write(folder / "trajectory.parquet", pd.DataFrame(columns), about | describe())


def write_session(folder, joints=LEG, shift=0.0, **metadata):
    """Write everything that an experiment leaves."""
    write_trajectory(folder, joints)
    recording = write_recording(folder, joints, **metadata)
    baseline = write_parameters(folder, joints, shift=shift, inputs=[recording])
    extended = write_parameters(folder, joints, extended=True, shift=shift, inputs=[recording])
    write_residuals(folder, joints, inputs=[recording])
    write_candidates(folder, joints)
    write_verdict(folder, joints, inputs=[recording], **decision_of(joints))
    for parameters, off in ((baseline, 0.05), (extended, 0.02)):
        write_replay(folder, parameters, recording, joints, off=off)
        write_loop(folder, parameters, joints)
    return folder
