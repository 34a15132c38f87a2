"""The identified parameters with their intervals, model by model."""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from typing import Any

import pandas as pd

from pipelines.contracts import Table
from pipelines.model import BASELINE
from pipelines.report.sections.symbols import meaning
from pipelines.report.session import Artifact, Session


@dataclass(frozen=True)
class Estimate:
    """One parameter of one model."""

    effect: str
    name: str
    symbol: str
    joint: str
    run: str
    unit: str
    value: float
    low: float | None
    high: float | None
    """Ends of the 95 % interval; None if there is none."""
    each_run: bool = False
    """Whether values differ from run to run; this is the first training run's."""
    meaning: str = ""
    """In words; empty for an unknown effect."""

    @property
    def key(self) -> tuple[str, str, str, str]:
        """Identity of the parameter across models."""
        return self.effect, self.joint, self.run, self.name

    @property
    def words(self) -> str:
        """Joint, symbol and run."""
        run = f"({self.run})" if self.run else ""
        per_run = "(per run: the first training run's)" if self.each_run else ""
        return " ".join(filter(None, (self.joint, self.symbol, run, per_run)))

    @property
    def addition(self) -> str:
        """Its effect in words; empty for rigid body and friction."""
        return "" if self.effect in BASELINE else self.effect.replace("_", " ")

    @property
    def half(self) -> float | None:
        """Half the width of its interval."""
        return None if self.low is None or self.high is None else 0.5 * (self.high - self.low)

    @property
    def is_assumed(self) -> bool:
        """Whether the value was assumed instead of fitted, or chosen from a few values."""
        return self.low is not None and self.low == self.high


@dataclass(frozen=True)
class Model:
    """A ``parameters/1`` file as the page shows it."""

    file: str
    title: str
    method: str
    estimates: tuple[Estimate, ...]
    collinear: list[str]
    unrealizable: list[str] | None
    """Reasons why no real machine has these values; None if the file has no such key."""
    remarks: list[str]
    """Sentences on its method and its peculiarities."""
    angle_noise: list[str]
    """Sentences on inertia underestimated because of noisy angles."""


def models(session: Session) -> list[Model]:
    """Return every model of a session, those of ``exoid identify`` first."""
    results = [
        (one, f"With {one.additions}" if one.additions else "Rigid body and friction")
        for one in session.identified
    ]
    if session.extended:
        title = "Extended by the named causes" if session.causes else "As the diagnosis fitted it"
        results.append((session.extended, title))
    return [_model(session, one, title) for one, title in results]


@dataclass(frozen=True)
class Row:
    """One parameter in every model."""

    first: Estimate
    """The estimate of the first model that has the parameter."""
    estimates: tuple[Estimate | None, ...]
    """One per model; None if the model lacks the parameter."""

    @property
    def span(self) -> tuple[float, float]:
        """The range that contains all intervals."""
        known = [e for e in self.estimates if e]
        # The value, too, as a parameter without interval has no ends.
        ends = [value for e in known for value in (e.value, e.low, e.high) if value is not None]
        return min(ends), max(ends)


def side_by_side(shown: Sequence[Model]) -> list[Row]:
    """Return each parameter of some models with its estimates."""
    by_key: dict[tuple[str, str, str, str], dict[int, Estimate]] = {}
    for number, model in enumerate(shown):
        for estimate in model.estimates:
            by_key.setdefault(estimate.key, {})[number] = estimate
    return [
        Row(next(iter(cells.values())), tuple(cells.get(number) for number in range(len(shown))))
        for cells in by_key.values()
    ]


def _model(session: Session, artifact: Artifact, title: str) -> Model:
    table = session.table(artifact)
    about = table.metadata
    return Model(
        file=session.shown(artifact.path),
        title=title,
        method=_method(about.get("method")),
        estimates=tuple(
            replace(e, meaning=meaning(session, e.effect, e.joint, e.name))
            for e in estimates(table)
        ),
        unrealizable=about.get("unrealizable"),
        collinear=about.get("collinear") or [],
        remarks=about.get("remarks") or [],
        angle_noise=about.get("angle_noise") or [],
    )


def estimates(table: Table) -> list[Estimate]:
    """Return the rows of a ``parameters/1`` table."""
    return [_estimate(row) for row in table.frame.to_dict("records")]


def _estimate(row: Mapping[Any, Any]) -> Estimate:
    low, high = (
        None if pd.isna(row[key]) else float(row[key]) for key in ("ci95_low", "ci95_high")
    )
    # A missing text is NaN in a table, as the joint of a rigid body.
    joint, run = (row[key] if isinstance(row[key], str) else "" for key in ("joint", "run"))
    return Estimate(
        effect=row["effect"],
        name=row["name"],
        symbol=row["symbol"],
        joint=joint,
        run=run,
        unit=row["unit"],
        value=float(row["value"]),
        low=low,
        high=high,
        each_run=bool(row.get("each_run")),
    )


def _method(method: Any) -> str:
    if isinstance(method, Mapping):
        return ", ".join(str(value) for value in method.values() if isinstance(value, str))
    return str(method) if method else ""
