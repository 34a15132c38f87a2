"""Another package can bring an effect, and a broken one is told apart from exoid."""

import re
import subprocess
import sys
from pathlib import Path
from textwrap import dedent

import numpy as np
import pytest
from numpy.testing import assert_allclose

from pipelines.effects import Effect, Parameter, Side
from pipelines.effects.kernel import torque_reading

PAGE = (Path(__file__).parents[2] / "docs" / "own-effect.md").read_text(encoding="utf-8")
"""A reader copies what it shows."""
(GOOD,) = re.findall(r"```python\n(.*?)```", PAGE, re.DOTALL)
(ENTRY,) = re.findall(r"^tendon_slack = .*$", PAGE, re.MULTILINE)
LISTED = "from pipelines.model import BY_NAME; print(list(BY_NAME)[-1], len(BY_NAME))"


@pytest.fixture
def python_with(tmp_path):
    """Run Python with a package installed whose entry point is
    ``cables.tendon_slack:TendonSlack``."""

    def run(module, *arguments):
        (tmp_path / "cables").mkdir()
        (tmp_path / "cables" / "tendon_slack.py").write_text(module, encoding="utf-8")
        installed = tmp_path / "cables-1.0.dist-info"
        installed.mkdir()
        (installed / "METADATA").write_text(
            "Metadata-Version: 2.1\nName: cables\nVersion: 1.0\n", encoding="utf-8"
        )
        entry = "[exoid.effects]\n" + ENTRY.replace('"', "") + "\n"
        (installed / "entry_points.txt").write_text(entry, encoding="utf-8")
        path = f"import sys; sys.path.insert(0, {str(tmp_path)!r}); "
        command = [sys.executable, "-c", path + dedent(arguments[0])]
        return subprocess.run(command, capture_output=True, text=True, check=False)

    return run


def test_an_effect_of_another_package_is_one_of_exoids(python_with):
    done = python_with(GOOD, LISTED)
    assert done.stdout == "tendon_slack 34\n", done.stderr


@pytest.mark.parametrize(
    ("module", "message"),
    [
        (
            "import no_such_module",
            "loading it failed: ModuleNotFoundError: No module named 'no_such_module'; correct it",
        ),
        ("TendonSlack = 3", "it is 3, expected a subclass of pipelines.effects.Effect; correct it"),
        (GOOD.replace("    equation =", "    unstated ="), "does not state equation"),
        (
            GOOD.replace('"tendon_slack"', '"cogging"'),
            "its name cogging is already used by pipelines",
        ),
    ],
    ids=["does not load", "no effect", "incomplete", "name taken"],
)
def test_a_broken_effect_is_one_line_that_names_its_package(python_with, module, message):
    done = python_with(module, "from exoid_cli.app import run; sys.exit(run(['effects']))")
    assert done.returncode == 2
    assert done.stderr.startswith(
        "exoid: effect tendon_slack (cables.tendon_slack:TendonSlack) of package cables"
    )
    assert message in done.stderr
    assert "uninstall cables" in done.stderr
    assert done.stderr.count("\n") == 1


def twice(t, torque, values, joint, state):
    torque[joint] *= 2.0


def twice_when_warm(t, torque, values, joint, state, temperature):
    if temperature[joint] > 0.0:
        torque[joint] *= 2.0


@pytest.mark.parametrize("sensor", [twice, twice_when_warm], ids=lambda sensor: sensor.__name__)
def test_a_torque_sensor_may_know_the_temperature_and_need_not(sensor, with_human):
    parameter = Parameter("gain", "1", "of the sensor", "g", (0.5, 2.0))
    stated = {"side": Side.SENSOR, "shape": (parameter,), "torque_reading": torque_reading(sensor)}
    torque = np.ones((*with_human.q.shape, 1))
    read = type("Twice", (Effect,), stated)("knee").observed(torque, with_human, (2.0,))
    assert_allclose(read[:, :, 0], [[1.0, 2.0]] * len(torque))
