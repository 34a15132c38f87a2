"""FIGAROH as its documentation recommends: a URDF, a configuration, a subclass that loads the data,
``solve``.

Friction is on; weighted least squares and the relative rank tolerance are set as in its own example
of an arm whose joints carry different torques; decimation by 10 is its default. It fits its own
base parameters, which hold what exoid takes for zero: masses beside the links' axes.
"""

import contextlib
import io
import tempfile
import time
from pathlib import Path

import numpy as np
import yaml
from figaroh.identification.base_identification import BaseIdentification
from figaroh.tools.load_robot import load_robot
from numpy.typing import NDArray

from tests.campaigns.blind.excitation import baseline_columns
from tests.campaigns.peers.answer import Answer, Log

CUTOFF_HZ = 10.0
LINK = """<link name="{name}"><inertial><origin xyz="0 0 {along}"/><mass value="{mass}"/>
<inertia ixx="0.02" ixy="0" ixz="0" iyy="0.02" iyz="0" izz="0.02"/></inertial></link>
<joint name="{joint}" type="revolute"><parent link="{parent}"/><child link="{name}"/>
<origin xyz="0 0 {at}"/><axis xyz="0 -1 0"/>
<limit lower="-3" upper="3" velocity="10" effort="300"/></joint>"""


def identify(log: Log, held_out: Log, masses: NDArray) -> Answer:
    """Fit a leg; ``masses`` (2,) kg are what its URDF says, and do not matter for base
    parameters."""
    begun = time.process_time()
    with tempfile.TemporaryDirectory() as folder, contextlib.redirect_stdout(io.StringIO()):
        fit = _fit(log, held_out, masses, Path(folder))
        verdict = fit.verify()
    own, error = fit.phi_base, np.abs(fit.phi_base) * fit.result["wls_std_deviations"] / 100.0
    seconds = time.process_time() - begun
    names = [f"base parameter of {name.split(' ')[0]}" for name in fit.params_base]
    to_own = _base_parameters(fit, log)
    words = [f"{verdict.status} (scope {verdict.scope})", *verdict.insights]
    values = np.linalg.solve(to_own, own)[:8]
    return Answer(
        "FIGAROH",
        values,
        names,
        own,
        1.96 * error,
        lambda truth: to_own[:, :8] @ truth,
        seconds,
        words,
    )


def _fit(log: Log, held_out: Log, masses: NDArray, folder: Path) -> BaseIdentification:
    urdf, config = folder / "leg.urdf", folder / "leg.yaml"
    links = LINK.format(
        name="thigh", joint="hip", parent="world", at=0, along=-log.length / 2, mass=masses[0]
    )
    links += LINK.format(
        name="shank", joint="knee", parent="thigh", at=-log.length, along=-0.2, mass=masses[1]
    )
    urdf.write_text(f'<robot name="leg"><link name="world"/>{links}</robot>')
    config.write_text(yaml.safe_dump(_configuration(log.rate_hz)))

    class Leg(BaseIdentification):
        def __init__(self, robot, config_file):
            super().__init__(robot, config_file)
            joints = [self.model.joints[self.model.getJointId(name)] for name in ("hip", "knee")]
            self.identif_config["act_idxq"] = [joint.idx_q for joint in joints]
            self.identif_config["act_idxv"] = [joint.idx_v for joint in joints]

        def load_trajectory_data(self, data_source=None):
            run = held_out if data_source else log
            return {
                "timestamps": run.time[:, np.newaxis],
                "positions": run.angle,
                "velocities": None,
                "accelerations": None,
                "torques": run.torque,
            }

    fit = Leg(load_robot(str(urdf), package_dirs=str(folder)), str(config))
    fit.initialize()
    fit.solve(wls=True, plotting=False)
    return fit


def _configuration(rate_hz: float) -> dict:
    return {
        "schema_version": "2.0",
        "robot": {
            "name": "leg",
            "properties": {
                "joints": {"active_joints": ["hip", "knee"]},
                "mechanics": {
                    "friction_coefficients": {"viscous": [0, 0], "static": [0, 0]},
                    "actuator_inertias": [0, 0],
                    "joint_offsets": [0, 0],
                    "reduction_ratios": [1.0, 1.0],
                },
                "coupling": {"has_coupled_wrist": False},
            },
        },
        "tasks": {
            "identification": {
                "enabled": True,
                "problem": {
                    "include_external_forces": False,
                    "use_joint_torques": True,
                    "qr_relative_tolerance": 1.0e-4,
                    "wls": True,
                    "model_components": {
                        "friction": True,
                        "actuator_inertia": False,
                        "joint_offset": False,
                    },
                },
                "signal_processing": {
                    "sampling_frequency": float(rate_hz),
                    "cutoff_frequency": CUTOFF_HZ,
                    "filter_type": "butterworth",
                    "filter_order": 4,
                },
                "data": {"validation_data_file": "held out"},
            }
        },
    }


def _base_parameters(fit: BaseIdentification, log: Log) -> NDArray:
    """(p, 10) from X1..X4, friction and two masses beside the axes to FIGAROH's base parameters.

    Both regressors span the same torques, so that the one is the other times this matrix.
    """
    q, dq, ddq = (fit.processed_data[key] for key in ("positions", "velocities", "accelerations"))
    columns = baseline_columns(q, dq, ddq, log.length, log.gravity)
    # A mass beside an axis is one on it, a quarter turn further on.
    beside = [
        baseline_columns(q + turn, dq, ddq, log.length, log.gravity)[:, :, i]
        for i, turn in _QUARTERS
    ]
    ours = (
        np.concatenate([columns, np.stack(beside, axis=2)], axis=2)
        .transpose(1, 0, 2)
        .reshape(-1, 10)
    )
    kept = np.delete(fit.dynamic_regressor, fit._idx_eliminated, axis=1)[:, fit._base_indices]
    return np.linalg.lstsq(kept, ours, rcond=None)[0]


_QUARTERS = ((2, np.array([0.0, np.pi / 2])), (3, np.array([np.pi / 2, 0.0])))
