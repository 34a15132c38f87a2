"""``exoid status``: the state of an experiment, a line for each stage."""

from collections import Counter
from collections.abc import Sequence
from itertools import groupby
from pathlib import Path
from typing import TYPE_CHECKING, Any

from exoid_cli.console import console
from exoid_cli.experiment_folder import open_experiment
from exoid_cli.options import ConfigOption, OutOption

if TYPE_CHECKING:
    from pipelines.workflow.freshness import JudgedStep


def status(config: ConfigOption = None, out: OutOption = None) -> None:
    """Say of each stage of an experiment whether it is done, stale and why, or missing.

    A result is stale where an input or a setting has changed since it was made. An imported
    recording that cannot be read has a line of its own, and makes the exit code 2,
    as the missing motion of a recording does.

    \b
    Examples:
      exoid status
      exoid status --config my_experiment/exoid.toml
    """
    from pipelines.workflow.freshness import Judge
    from pipelines.workflow.investigation import refuse_lost_motion

    folder = open_experiment(config, out, allow_damaged=True)
    judged = Judge(folder.out).all(folder.steps)
    # Advice on a recording that cannot be read.
    remedy = "import it again, or remove it"
    of_damaged = {"stage": "import", "state": "damaged", "why": [remedy], "command": None}
    damaged = [of_damaged | {"target": file} for file in folder.imported.damaged]
    console.emit([*damaged, *map(_as_json, judged)])
    # Steps of a stage follow each other in the graph, as groupby needs.
    stages = [list(group) for _, group in groupby(judged, lambda one: one.step.stage)]
    files = [file.relative_to(folder.out).as_posix() for file in folder.imported.damaged]
    rows = [("import", "damaged", file, remedy) for file in files]
    rows += [_line(stage, folder.out) for stage in stages]
    console.table(("stage", "state", "result", "why"), rows)
    # After the table, so that the state of all else is seen.
    folder.imported.refuse_damaged()
    refuse_lost_motion(folder.experiment, folder.out)
    todo = sum(not one.done for one in judged)
    to_do = (
        f"{todo} of {len(judged)} steps {'is' if todo == 1 else 'are'} to do; `exoid run` does what"
        " is to do."
    )
    console.say(f"\n{to_do if todo else 'Everything is up to date.'}")


def _line(stage: "Sequence[JudgedStep]", out: Path) -> tuple[str, str, str, str]:
    count = Counter(one.state.value for one in stage)
    # A stage is as bad as its worst step.
    state = next(word for word in ("missing", "stale", "left out", "done") if count[word])
    reasons = list(dict.fromkeys(reason for one in stage for reason in one.why))
    why = reasons[0] if reasons else ""
    if len(reasons) > 1:
        why += f" (and {len(reasons) - 1} more)"
    step = stage[0].step
    result = step.target.relative_to(out)
    if len(stage) == 1:
        return step.stage, state, result.as_posix(), why
    parts = f"{count[state]} of {len(stage)} in {result.parent.as_posix()}/"
    return step.stage, state, parts, why


def _as_json(one: "JudgedStep") -> dict[str, Any]:
    return {
        "stage": one.step.stage,
        "target": one.step.target,
        "state": one.state.value,
        "why": list(one.why),
        "command": ["exoid", *one.step.command],
    }
