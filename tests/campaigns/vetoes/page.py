"""Write docs/vetoes.md: how often sound recordings are stopped, and how often faults are named."""

from collections.abc import Iterable, Sequence
from itertools import pairwise

from tests.campaigns.blind.statistics import Rate
from tests.campaigns.vetoes.examination import Outcome

LARGE = 0.1
"""Share of the error from which a fault has to be named."""
SHARES = (0.0, 0.01, 0.1, 0.5, 0.9, 1.01)
INTRODUCTION = """# How often acquisition is blamed

For everyone whose diagnosis was stopped by a fault of acquisition, or fears a fault that nobody
names. Written by `make vetoes`. Sessions of all worlds of the [blind examination](blind.md) and the
[real recordings](real-data.md) are examined as they are, and with faults put into them. Most
sessions hide missing physics as well. Brackets hold Wilson's 95 % interval of a share.

A fault's *share* is the part of the error that it makes, for the model fitted to the sound runs.
The angle of one joint alone does not show uneven instants: these are put into two joints only.
"""


def page(outcomes: Sequence[Outcome], command: str) -> str:
    """Return the page."""
    sound = [one for one in outcomes if one.fault is None]
    spoilt = [one for one in outcomes if one.fault is not None]
    large = [one for one in spoilt if one.share >= LARGE]
    false, named = _stopped(sound), _named(large)
    return "\n".join(
        [
            INTRODUCTION,
            f"`{command}`: {len(sound)} sessions, {len(spoilt)} faults in them.\n",
            "| measure | target | measured | met |\n| --- | --- | --- | --- |",
            f"| sound sessions stopped | <= 1 % | {false} | {_met(false, most=0.01)} |",
            f"| faults of a tenth of the error or more, named | >= 98 % | {named} |"
            f" {_met(named, least=0.98)} |",
            "",
            *_section("Sound sessions", "world", sound, lambda one: one.world, _sound_row),
            "A caveat is a fault that is named and does not stop the diagnosis.\n",
            *_section("Faults", "fault", spoilt, lambda one: one.fault, _fault_row),
            *_section("By world", "world", spoilt, lambda one: one.world, _fault_row),
            *_section("By share of the error", "share", spoilt, _bin, _share_row),
            *_words("Sound sessions that were stopped", (one for one in sound if one.vetoes)),
            *_words("Large faults that were not named", (one for one in large if not one.named)),
        ]
    )


def _stopped(outcomes: Iterable[Outcome]) -> Rate:
    return Rate.of(bool(one.vetoes) for one in outcomes)


def _named(outcomes: Iterable[Outcome]) -> Rate:
    return Rate.of(one.named for one in outcomes)


def _met(rate: Rate, least: float = 0.0, most: float = 1.0) -> str:
    return "yes" if rate.value is not None and least <= rate.value <= most else "**no**"


def _section(title, heading, outcomes, key, row) -> list[str]:
    groups: dict[str, list[Outcome]] = {}
    for one in outcomes:
        groups.setdefault(key(one), []).append(one)
    headings = {_sound_row: ["stopped", "with a caveat"], _share_row: ["named", "stopped"]}.get(
        row, ["named, share of a tenth or more", "of these stopped", "named, smaller"]
    )
    lines = [f"## {title}\n", f"| {' | '.join([heading, *headings])} |"]
    lines.append(f"|{' --- |' * (1 + len(headings))}")
    lines += [f"| {' | '.join([name, *row(groups[name])])} |" for name in sorted(groups)]
    return [*lines, ""]


def _sound_row(group: Sequence[Outcome]) -> list[str]:
    return [
        str(_stopped(group)),
        str(Rate.of(bool(one.others) and not one.vetoes for one in group)),
    ]


def _fault_row(group: Sequence[Outcome]) -> list[str]:
    large = [one for one in group if one.share >= LARGE]
    small = [one for one in group if one.share < LARGE]
    return [str(_named(large)), str(_stopped(large)), str(_named(small))]


def _share_row(group: Sequence[Outcome]) -> list[str]:
    return [str(_named(group)), str(_stopped(group))]


def _bin(one: Outcome) -> str:
    low, high = next((a, b) for a, b in pairwise(SHARES) if a <= max(one.share, 0.0) < b)
    return f"{100 * low:.0f} to {100 * min(high, 1.0):.0f} %"


def _words(title: str, outcomes: Iterable[Outcome]) -> list[str]:
    lines = [
        f"- {one.world}, {one.session}, hides {one.hidden or 'nothing known'}"
        f"{f', {one.fault}, share {one.share:.2f}' if one.fault else ''}."
        # A message of exoid is quoted as it is printed.
        f"{f'{chr(10) * 2}      {one.words}' if one.words else ''}"
        for one in outcomes
    ]
    return [f"## {title}\n", *(lines or ["None."]), ""]
