"""Does a test fail for every change of a number that decides, or of a limit that keeps a leg safe?

``make mutation`` changes one number, comparison or operator at a time in a copy of the code, as
cosmic-ray does, and runs the tests that claim something about that file. A mutant that survives is
a number without a test. Less than nine mutants in ten killed fails.
"""

import json
import shutil
import subprocess
import sys
from dataclasses import dataclass
from pathlib import Path

ROOT = Path(__file__).parents[2]
COPIED = ("pipelines", "exoid_cli", "tests", "datasets", "docs", "pyproject.toml")
LEAST_KILLED = 0.9


@dataclass(frozen=True)
class Target:
    """A file whose mutants are to be killed, and the tests that are to kill them."""

    module: str
    tests: tuple[str, ...]
    timeout_s: float


TARGETS = {
    "criteria": Target(
        "pipelines/diagnosis/criteria.py", ("tests/diagnosis/test_criteria.py",), 120.0
    ),
    "limits": Target(
        "pipelines/acquisition/safety/limits.py",
        # The quickest first: most mutants go no further.
        (
            "tests/acquisition/safety/test_limit_values.py",
            "tests/acquisition/safety",
            "tests/acquisition/test_stopping.py",
        ),
        300.0,
    ),
}


def mutate(name: str, folder: Path) -> float:
    """Return the share of a target's mutants that are killed; print those that survive."""
    target = TARGETS[name]
    copy = folder / name
    shutil.rmtree(copy, ignore_errors=True)
    for part in COPIED:
        source = ROOT / part
        if source.is_dir():
            shutil.copytree(source, copy / part, ignore=shutil.ignore_patterns("__pycache__"))
        else:
            shutil.copy(source, copy / part)
    tests = f"{sys.executable} -m pytest -x -q -p no:cacheprovider -m 'not slow' "
    settings = {
        "module-path": target.module,
        "timeout": target.timeout_s,
        "excluded-modules": [],
        "test-command": tests + " ".join(target.tests),
    }
    lines = [f"{key} = {json.dumps(value)}" for key, value in settings.items()]
    distributor = ["[cosmic-ray.distributor]", 'name = "local"']
    (copy / "mutation.toml").write_text("\n".join(["[cosmic-ray]", *lines, *distributor, ""]))
    for command in (
        ["baseline", "mutation.toml"],
        ["init", "mutation.toml", "mutation.sqlite"],
        ["exec", "mutation.toml", "mutation.sqlite"],
    ):
        subprocess.run(cosmic_ray(*command), cwd=copy, check=True)
    dump = subprocess.run(
        cosmic_ray("dump", "mutation.sqlite"), cwd=copy, check=True, capture_output=True, text=True
    )
    return killed_share(name, dump.stdout)


def cosmic_ray(*arguments: str) -> list[str]:
    """Return a command of cosmic-ray."""
    return [sys.executable, "-m", "cosmic_ray.cli", *arguments]


def killed_share(name: str, dump: str) -> float:
    """Return the share of mutants that a test killed, from a session as JSON lines."""
    pairs = [json.loads(line) for line in dump.splitlines()]
    survivors = [item for item, result in pairs if result["test_outcome"] == "survived"]
    for item in survivors:
        (mutation,) = item["mutations"]
        line, _ = mutation["start_pos"]
        print(f"survived: {mutation['module_path']}:{line} {mutation['operator_name']}")
    share = 1.0 - len(survivors) / len(pairs)
    print(f"{name}: {len(pairs)} mutants, {share:.0%} killed")
    return share


def main() -> int:
    """Mutate the targets that the command line names, or all."""
    names = sys.argv[1:] or list(TARGETS)
    shares = [mutate(name, ROOT / "build" / "mutation") for name in names]
    return int(min(shares) < LEAST_KILLED)


if __name__ == "__main__":
    sys.exit(main())
