"""``docs/peers.md`` from what was measured."""

from collections.abc import Sequence
from importlib.metadata import version
from pathlib import Path
from typing import Any

import numpy as np

from tests.campaigns.peers.sessions import DURATION_S, REST, STIFFNESS

TOOLS = ("IDIM-LS", "FIGAROH", "MuJoCo sysid", "exoid")
INTRODUCTION = Path(__file__).with_name("introduction.md")


def page(
    plain: Sequence[dict[str, Any]], sprung: Sequence[dict[str, Any]], real: dict[str, Any] | None
) -> str:
    """Return the page for simulated legs without and with a hidden spring, and for the double
    pendulum."""
    introduction = INTRODUCTION.read_text(encoding="utf-8").format(
        figaroh=version("figaroh"), mujoco=version("mujoco"), duration_s=DURATION_S
    )
    parts = [introduction, _without(plain), _with(sprung)]
    if real:
        parts.append(_real(real))
    return "\n".join(parts)


def _without(legs: Sequence[dict[str, Any]]) -> str:
    rows = [
        _row(
            "tool",
            "true values in 95 % intervals",
            "median / worst parameter error",
            "held-out torque",
            "s",
        )
    ]
    rows.append("|---|---|---|---|---|")
    for tool in TOOLS:
        results = [leg["tools"][tool] for leg in legs]
        inside = np.concatenate([f["inside"] for f in results])
        errors = np.array([f["parameter_error"] for f in results])
        rows.append(
            _row(
                tool,
                f"{100 * inside.mean():.0f} % of {len(inside)}",
                f"{100 * np.median(errors):.1f} / {100 * errors.max():.0f} %",
                _pooled([f["error"] for f in results]),
                f"{np.median([f['seconds'] for f in results]):.2g}",
            )
        )
    statuses = [leg["diagnosed"]["status"] for leg in legs]
    counts = ", ".join(
        f"`{status}` {statuses.count(status)} of {len(legs)}" for status in sorted(set(statuses))
    )
    named = [f"{cause}" for leg in legs for cause in leg["diagnosed"]["causes"]]
    seconds = np.median([leg["diagnosed"]["seconds"] for leg in legs])
    return f"""## {len(legs)} legs with nothing hidden

{chr(10).join(rows)}

Held-out torque: RMS error at hip / knee, N·m, of {_pooled([leg["torque_rms"] for leg in legs])} N·m
rms. `exoid diagnose`, {seconds:.0f} s a leg, says
{counts}{"; it names " + "; ".join(named) if named else ""}.
"""


def _with(legs: Sequence[dict[str, Any]]) -> str:
    rows = [
        _row(
            "tool",
            "held-out torque",
            "farthest parameter of each leg, half-widths off",
            "what it says",
        )
    ]
    rows.append("|---|---|---|---|")
    for tool in TOOLS:
        results = [leg["tools"][tool] for leg in legs]
        worst = ", ".join(f"{f['worst']} {f['half_widths_off']:.0f}" for f in results)
        says = "; ".join(dict.fromkeys(word for f in results for word in f["says"])) or "nothing"
        name = "`exoid identify`" if tool == "exoid" else tool
        rows.append(_row(name, _pooled([f["error"] for f in results]), worst, says))
    after = [leg["diagnosed"] for leg in legs]
    verdicts = "; ".join(f"`{d['status']}`: {', '.join(d['causes']) or 'no cause'}" for d in after)
    rows.append(_row("`exoid diagnose`", _pooled([d["error"] for d in after]), "", verdicts))
    return f"""## {len(legs)} legs with a spring of {STIFFNESS:g} N·m/rad hidden at the knee

The spring rests at {REST:g} rad. No tool's model has it.

{chr(10).join(rows)}
"""


def _real(real: dict[str, Any]) -> str:
    rows = [
        _row("tool", "held-out torque", "below 5 Hz", "s", "what it says"),
        "|---|---|---|---|---|",
    ]
    verdict = real["diagnosed"]
    causes = f"`{verdict['status']}`: {', '.join(verdict['causes']) or 'no cause'}"
    diagnosed = {"`exoid diagnose`": verdict | {"says": [causes]}}
    for tool, f in (real["tools"] | diagnosed).items():
        errors = (_pooled([f[key]]) for key in ("error", "slow_error"))
        rows.append(_row(tool, *errors, f"{f['seconds']:.2g}", "; ".join(f["says"])))
    rms = _pooled([real["torque_rms"]])
    return f"""## A real double pendulum

`A0_fourier_75s.csv` through `exoid import` with `datasets/maps/double_pendulum_fourier.toml`: the
first 70 % to train, the rest to validate, {rms} N·m rms at shoulder / elbow. Its controller was not
logged: MuJoCo's rollouts would have to run on the torque alone, in short windows, which was not
tried. IDIM-LS and FIGAROH get the irregular log on a uniform grid. The truth is not known.

{chr(10).join(rows)}

Above 5 Hz these angles are noise, which every model turns into torque. So the error below 5 Hz
is listed too, reversals included, as in [real-data.md](real-data.md). `exoid diagnose` looked there
alone, and gains there alone; IDIM-LS and FIGAROH filter at 10 Hz.
"""


def _pooled(errors: Sequence[Sequence[float]]) -> str:
    return " / ".join(f"{e:.3g}" for e in np.sqrt(np.mean(np.square(errors), axis=0)))


def _row(*cells: str) -> str:
    return f"| {' | '.join(cells)} |"
