"""The identified parameters with their intervals, model by model."""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from typing import Any

from pipelines.contracts import Table
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
    """Ends of the 95 % interval; None where there is none."""
    std_error: float | None = None
    each_run: bool = False
    """Whether each run has its own, of which this is the first training run's."""
    meaning: str = ""
    """What it is, in words; nothing where nobody here knows."""

    @property
    def key(self) -> tuple[str, str, str, str]:
        """What makes it the same parameter in two models."""
        return self.effect, self.joint, self.run, self.name

    @property
    def words(self) -> str:
        """Say which it is."""
        run, own = (
            f"({self.run})" if self.run else "",
            "(per run: the first training run's)" if self.each_run else "",
        )
        return " ".join(filter(None, (self.joint, self.symbol, run, own)))

    @property
    def half(self) -> float | None:
        """Half the width of its interval."""
        return None if self.low is None or self.high is None else 0.5 * (self.high - self.low)

    @property
    def is_taken(self) -> bool:
        """Whether it was taken and not fitted, or chosen among a few values."""
        return self.low is not None and self.low == self.high


@dataclass(frozen=True)
class Model:
    """A ``parameters/1`` file as the page shows it."""

    file: str
    title: str
    method: str
    estimates: tuple[Estimate, ...]
    collinear: tuple[str, ...]
    unrealizable: tuple[str, ...] | None
    """Why it is no real machine; None where the file does not say."""
    remarks: tuple[str, ...]
    """What its method, or what is strange about it, is worth a sentence."""
    angle_noise: tuple[str, ...]
    """Why the angles let its rigid bodies be too light; empty where they do not."""
    validation: dict[str, dict[str, dict[str, float]]]


def models(session: Session) -> list[Model]:
    """Return every model of a session, those of ``exoid identify`` first."""
    results = [
        (one, f"With {one.besides}" if one.besides else "Rigid body and friction")
        for one in session.identified
    ]
    if session.extended:
        named = bool(session.verdict and session.verdict["causes"])
        results.append(
            (
                session.extended,
                "Extended by the named causes" if named else "As the diagnosis fitted it",
            )
        )
    return [_model(session, one, title) for one, title in results]


@dataclass(frozen=True)
class Row:
    """One parameter in every model."""

    first: Estimate
    """As the first model that has it says it: which it is, and its unit."""
    estimates: tuple[Estimate | None, ...]
    """One a model; None where it has no such parameter."""

    @property
    def span(self) -> tuple[float, float]:
        """The range that all its intervals lie in."""
        known = [e for e in self.estimates if e]
        ends = [value for e in known for value in (e.value, e.low, e.high) if value is not None]
        return min(ends), max(ends)


def side_by_side(shown: Sequence[Model]) -> list[Row]:
    """Return every parameter of some models, in the order of the first that has it."""
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
    unrealizable = about.get("unrealizable")
    return Model(
        file=session.shown(artifact.path),
        title=title,
        method=_method(about.get("method")),
        estimates=tuple(
            replace(e, meaning=meaning(session, e.effect, e.joint, e.name))
            for e in estimates(table)
        ),
        collinear=tuple(map(str, about.get("collinear") or ())),
        unrealizable=None if unrealizable is None else tuple(map(str, unrealizable)),
        remarks=tuple(map(str, about.get("remarks") or ())),
        angle_noise=tuple(map(str, about.get("angle_noise") or ())),
        validation=about.get("validation") or {},
    )


def estimates(table: Table) -> list[Estimate]:
    """Return the rows of a ``parameters/1`` table."""
    return [
        _estimate({str(k): v for k, v in row.items()}) for row in table.frame.to_dict("records")
    ]


def _estimate(row: Mapping[str, Any]) -> Estimate:
    low, high, error = (
        None if row[key] is None or row[key] != row[key] else float(row[key])
        for key in ("ci95_low", "ci95_high", "std_error")
    )
    joint, run = (row[key] if isinstance(row[key], str) else "" for key in ("joint", "run"))
    return Estimate(
        row["effect"],
        row["name"],
        row["symbol"],
        joint,
        run,
        row["unit"],
        float(row["value"]),
        low,
        high,
        error,
        bool(row.get("each_run")),
    )


def _method(method: Any) -> str:
    if isinstance(method, Mapping):
        return ", ".join(str(value) for value in method.values() if isinstance(value, str))
    return str(method) if method else ""
