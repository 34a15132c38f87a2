"""One leg or one real machine through every tool, and what came of it in numbers that a page can
show."""

import json
import tempfile
from collections.abc import Sequence
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from exoid_cli.app import run
from pipelines.settings.datasets import datasets
from tests.campaigns.peers import exoid_fit, figaroh_fit, idim_ls, mujoco_sysid
from tests.campaigns.peers.answer import Answer, Log
from tests.campaigns.peers.exoid_fit import HeldOut
from tests.campaigns.peers.sessions import logs_by_purpose, simulated


def leg(number: int, spring: bool, out: Path) -> dict[str, Any]:
    """Compare the tools on a simulated leg; what is already in ``out`` is not done again."""
    kept = out / f"leg-{number}{'-spring' if spring else ''}.json"
    if not kept.exists():
        with tempfile.TemporaryDirectory() as folder:
            one = simulated(number, spring, Path(folder))
            given = mujoco_sysid.Given(one.masses, one.thigh_inertia)
            answers = [
                idim_ls.identify(one.train),
                figaroh_fit.identify(one.train, one.validate, one.masses),
                mujoco_sysid.identify(one.train, given),
            ]
            _keep(kept, _compared(one.files, answers, one.validate, one.truth))
    return json.loads(kept.read_text())


def double_pendulum(data: Path, out: Path) -> dict[str, Any]:
    """Compare them on the double pendulum's Fourier run; no controller was logged for MuJoCo to
    follow."""
    kept = out / "double-pendulum.json"
    if not kept.exists():
        with tempfile.TemporaryDirectory() as folder:
            log = data / "double_pendulum" / "A0_fourier_75s.csv"
            code = run(["import", str(log), "--map", str(_MAP), "-o", folder, "--quiet"])
            assert code == 0, f"exoid import ended with {code}"
            files = sorted(Path(folder).glob("*.parquet"))
            logs = logs_by_purpose(files)
            masses = np.array([0.56, 0.60])  # its makers' file
            answers = [
                idim_ls.identify(logs["train"]),
                figaroh_fit.identify(logs["train"], logs["validate"], masses),
            ]
            _keep(kept, _compared(files, answers, logs["validate"], None))
    return json.loads(kept.read_text())


_MAP = datasets() / "maps" / "double_pendulum_fourier.toml"


def _keep(path: Path, what: dict[str, Any]) -> None:
    path.parent.mkdir(parents=True, exist_ok=True)
    part = path.with_suffix(".part")
    part.write_text(json.dumps(what, indent=1))
    part.rename(path)


def _compared(
    files: Sequence[Path], answers: list[Answer], judged: Log, truth: NDArray | None
) -> dict[str, Any]:
    ours, held_out = exoid_fit.identify(files)
    said = exoid_fit.diagnose(files)
    return {
        "torque_rms": held_out.error(np.zeros_like(held_out.motion.torque)).tolist(),
        "tools": {a.tool: _scored(a, held_out, judged, truth) for a in [*answers, ours]},
        "diagnosed": {"status": said.status, "causes": said.causes, "seconds": said.seconds}
        | _errors(held_out, said.torque),
    }


def _errors(held_out: HeldOut, predicted: NDArray) -> dict[str, list[float]]:
    return {
        "error": held_out.error(predicted).tolist(),
        "slow_error": held_out.slow_error(predicted).tolist(),
    }


def _scored(
    answer: Answer, held_out: HeldOut, judged: Log, truth: NDArray | None
) -> dict[str, Any]:
    motion = held_out.motion
    predicted = answer.torque(motion.q, motion.dq, motion.ddq, judged)
    found = {"seconds": answer.seconds, "says": list(answer.says)} | _errors(held_out, predicted)
    if truth is None:
        return found
    off = answer.half_widths_off(truth)
    return found | {
        "inside": answer.inside(truth).tolist(),
        "parameter_error": (np.abs(answer.values - truth) / np.abs(truth)).tolist(),
        "worst": answer.names[int(np.argmax(off))],
        "half_widths_off": float(np.max(off)),
    }
