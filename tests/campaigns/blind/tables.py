"""The tables of an examination, for the terminal and for Markdown alike."""

from collections import Counter
from collections.abc import Callable, Iterable, Sequence
from dataclasses import dataclass

import numpy as np

from tests.campaigns.blind.scoring import Named, Score
from tests.campaigns.blind.statistics import Rate, reliability
from tests.campaigns.blind.targets import effects, measures, of, rmse_over_floor, world_measures

BINS = ((0.0, 0.03), (0.03, 0.06), (0.06, 0.12), (0.12, 1.0))
VISIBILITY = ((0.0, 0.1), (0.1, 0.2), (0.2, 0.5), (0.5, 1.0), (1.0, float("inf")))
MOST_SHOWN = 4
QUANTILES = (0.05, 0.25, 0.5, 0.75, 0.95, 1.0)


@dataclass(frozen=True)
class Page:
    """One table."""

    title: str
    head: tuple[str, ...]
    rows: list[tuple[str, ...]]


def label(named: Named) -> str:
    """Return a cause and its joint, as in ``backlash@knee``."""
    return "@".join(part for part in named if part)


def hidden(s: Score) -> str:
    """Say what was hidden."""
    return " + ".join(label(t) for t in s.truth) or s.category


def answer(s: Score) -> str:
    """Say what was named, or the status where nothing was."""
    return " + ".join(label(n) for n in s.named) or s.status


def summary(scores: Sequence[Score]) -> Page:
    """Show what is asked for, and what was measured."""
    return Page(
        "Summary",
        ("measure", "result", "target"),
        [(m.name, m.shown, m.target) for m in measures(scores)],
    )


def by_cause(scores: Sequence[Score]) -> Page:
    """Count singles by what was hidden."""
    return _rates("By cause and joint", of(scores, "single"), lambda s: label(s.truth[0]))


def by_magnitude(scores: Sequence[Score]) -> Page:
    """Count singles by their share of the joint's rms torque."""
    return _rates("By magnitude (share of the joint's rms torque)", of(scores, "single"), _bin_of)


def by_visibility(scores: Sequence[Score]) -> Page:
    """Count singles by what of them is there to be seen."""
    title = "By visibility (the part that the baseline cannot imitate, over the noise floor)"
    return _rates(title, of(scores, "single"), _visibility_of)


def by_form(scores: Sequence[Score]) -> Page:
    """Count singles by each functional form."""
    singles = of(scores, "single")
    return _rates(
        "By functional form",
        singles,
        lambda s: f"{s.truth[0][0]}: {s.forms[0]}{' (own)' * s.own_form}",
    )


def by_origin(scores: Sequence[Score]) -> Page:
    """Count singles by whether the plant's form is the catalogue's."""
    singles = of(scores, "single")
    return _rates(
        "By origin of the form",
        singles,
        lambda s: "the catalogue's own" if s.own_form else "another",
    )


def by_machine(scores: Sequence[Score]) -> Page:
    """Count singles by the machine that has them."""
    return _rates("By machine", of(scores, "single"), lambda s: s.machine)


def by_world(scores: Sequence[Score]) -> Page:
    """Show each world's rates, and how far its probabilities are to be believed."""
    worlds = sorted({s.world for s in scores})
    head = ("", *worlds)
    columns = [world_measures([s for s in scores if s.world == world]) for world in worlds]
    rows = [(column[0].name, *(m.shown for m in column)) for column in zip(*columns, strict=True)]
    return Page("By world", head, rows if len(worlds) > 1 else [])


def by_kinds(scores: Sequence[Score]) -> Page:
    """Count singles by the kinds of run in the session."""
    return _rates("By kinds of run", of(scores, "single"), lambda s: ", ".join(s.kinds))


def pairs(scores: Sequence[Score]) -> Page:
    """Count pairs by how many of the two were named."""
    scores_of_pairs = of(scores, "pair")
    rights = ((s, min(2, sum(was for _, was in s.probabilities))) for s in scores_of_pairs)
    counts = Counter("both" if s.right else "one" if n else "none" for s, n in rights)
    rows = [(n, str(Rate(counts[n], len(scores_of_pairs)))) for n in ("both", "one", "none")]
    return Page("Pairs", ("named", "share"), rows if scores_of_pairs else [])


def alarms(scores: Sequence[Score]) -> Page:
    """Count false alarms."""
    rows = []
    for name, category in (("nothing hidden", "none"), ("small imperfections", "imperfect")):
        chosen = of(scores, category)
        if chosen:
            rows.append((name, str(Rate.of(not s.right for s in chosen)), _instead(chosen)))
    return Page("False alarms", ("", "share", "which"), rows)


def outside(scores: Sequence[Score]) -> Page:
    """Count what is not in the catalogue, by kind."""
    return _rates("Outside the catalogue", of(scores, "outside"), _kind_of)


def families(scores: Sequence[Score]) -> Page:
    """Count right families of laws, of what nobody listed by kind, of the catalogue by effect."""
    judged = [s for s in of(scores, "single", "outside") if s.family_right is not None]
    rows = []
    for name in sorted({_kind_of(s) for s in judged}):
        chosen = [s.family_right for s in judged if _kind_of(s) == name]
        rows.append((name, str(Rate.of(chosen))))
    return Page("Families of laws", ("hidden", "right"), rows)


def _kind_of(s: Score) -> str:
    return s.truth[0][0].removeprefix("outside:") + " (held back)" * s.held_back


def faults(scores: Sequence[Score]) -> Page:
    """Count faults of acquisition, by kind."""
    return _rates("Data faults", of(scores, "fault"), lambda s: s.truth[0][0])


def misses(scores: Sequence[Score]) -> Page:
    """List wrong answers with their seeds, so that each can be looked at."""
    rows = [
        (
            str(s.seed),
            hidden(s),
            ", ".join(s.forms) if s.category in ("single", "pair", "outside") else "",
            f"{s.magnitude:.3f}" if s.magnitude else "",
            answer(s),
        )
        for s in sorted(scores, key=lambda s: s.seed)
        if not s.right
    ]
    return Page("Wrong answers", ("seed", "hidden", "form", "magnitude", "answer"), rows)


def kinds_of_miss(scores: Sequence[Score]) -> Page:
    """Count wrong answers by what was hidden, those that are wrong most first."""
    wrong = [s for s in scores if not s.right]
    rows = []
    for name, _ in Counter(sorted(hidden(s) for s in wrong)).most_common():
        answers = Counter(answer(s) for s in wrong if hidden(s) == name)
        rows.append((name, ", ".join(f"{words} {n}" for words, n in answers.most_common())))
    return Page("Every wrong answer", ("hidden", "answers"), rows)


def confusion(scores: Sequence[Score]) -> Page:
    """Count what was hidden (rows) against what was named first (columns, by the rows' numbers).

    A tie that counts as right stands on the diagonal, as does silence about what could not be seen;
    the right cause at the wrong joint under ``joint``.
    """
    singles = of(scores, "single")
    known = sorted({*effects(singles), *(s.named[0][0] for s in singles if s.named)})
    others = sorted({s.status for s in singles if not s.named and not s.right})
    counts = Counter((s.truth[0][0], _column(s)) for s in singles)
    columns = [*known, "joint", *others]
    head = ("hidden", *(str(i + 1) for i in range(len(known))), "joint", *others)
    rows = [
        (f"{i + 1} {effect}", *(str(counts[effect, c] or "") for c in columns))
        for i, effect in enumerate(known)
    ]
    return Page("Confusion: hidden against named first", head, rows if singles else [])


def residuals(scores: Sequence[Score]) -> Page:
    """Show quantiles of the extended model's error over the true noise floor."""
    rows = []
    for category in ("single", "pair", "none"):
        ratios = rmse_over_floor(of(scores, category))
        if ratios:
            rows.append((category, *(f"{q:.3f}" for q in np.quantile(ratios, QUANTILES))))
    return Page("Extended RMSE over the true noise floor", ("", *_quantiles()), rows)


def seconds(scores: Sequence[Score]) -> Page:
    """Show quantiles of the time that a diagnosis took."""
    rows = [tuple(f"{q:.1f}" for q in np.quantile([s.seconds for s in scores], QUANTILES))]
    return Page("Seconds a diagnosis", _quantiles(), rows)


def probabilities(scores: Sequence[Score]) -> Page:
    """Show whether probabilities mean what they say."""
    curve = reliability([f for s in scores for f in s.probabilities])
    rows = [(f"{b.low:.1f} to {b.high:.1f}", f"{b.mean:.3f}", str(b.happened)) for b in curve]
    return Page("Reliability of the probabilities", ("stated", "mean", "frequency"), rows)


def coverage(scores: Sequence[Score]) -> Page:
    """Show how often the parameters' intervals hold the truth."""
    covered = [c for s in scores for c in s.covered]
    names = sorted({c[:2] for c in covered})
    rows = [(f"{e}: {p}", str(Rate.of(c[2] for c in covered if c[:2] == (e, p)))) for e, p in names]
    return Page(
        "Coverage of the parameters' 95 % intervals", ("parameter", "holds the truth"), rows
    )


def _rates(title: str, scores: Sequence[Score], key: Callable[[Score], str]) -> Page:
    rows = []
    for name in sorted({key(s) for s in scores}):
        chosen = [s for s in scores if key(s) == name]
        rows.append((name, str(Rate.of(s.right for s in chosen)), _instead(chosen)))
    return Page(title, ("", "right", "else"), rows)


def _instead(scores: Iterable[Score]) -> str:
    """Count what wrong answers named first, the most frequent of them."""
    counts = Counter(label(s.named[0]) if s.named else s.status for s in scores if not s.right)
    shown = [f"{first} {n}" for first, n in counts.most_common(MOST_SHOWN)]
    rest = counts.total() - sum(n for _, n in counts.most_common(MOST_SHOWN))
    return ", ".join([*shown, *([f"others {rest}"] if rest else [])])


def _bin_of(s: Score) -> str:
    low, high = next(b for b in BINS if b[0] <= s.magnitude < b[1])
    return f"{100 * low:2.0f} to {100 * high:.0f} %"


def _visibility_of(s: Score) -> str:
    low, high = next(b for b in VISIBILITY if b[0] <= s.visibility < b[1])
    return f"{low:g} to {high:g}"


def _column(s: Score) -> str:
    if s.right:
        return s.truth[0][0]
    if not s.named:
        return s.status
    return "joint" if s.named[0][0] == s.truth[0][0] else s.named[0][0]


def _quantiles() -> tuple[str, ...]:
    words = {0.5: "median", 1.0: "most"}
    return tuple(words.get(q, f"{100 * q:g} %") for q in QUANTILES)
