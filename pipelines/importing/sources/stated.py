"""What a text says in words of its values: that they were corrected, and comments between rows."""

import mmap
import re
from collections.abc import Sequence
from pathlib import Path

_ALTERED = re.compile(
    r"""\b(
    gravity.?(correct|compensat|eliminat|effect)\w* | (limb|leg|arm).?weight.?correct\w*
    | (schwerkraft|gewichts|gravitations).?(korrektur|kompensation|korrigiert)\w*
    | (correction|compensation).de.(la.)?(gravité|pesanteur)
    | (gravity|weight|friction|inertia|offset|zero|drift|baseline).?
      (correct|compensat|remov|subtract|adjust)\w*
    | (reibungs|trägheits|offset|nullpunkt|drift).?(korrektur|kompensation|korrigiert)\w*
    | auto.?zero\w* | tare[ds]? | taring | zeroed | tariert | tarierung | nulled | tar[ée]e?
    | normali[sz]ed | normiert | normalisée?
    )\b""",
    re.IGNORECASE | re.VERBOSE,
)
"""Words for a change of the values by another program, in English, German and French."""
_NO = "off|no|none|not|false|disabled|never|without|aus|nein|nicht|ohne|keine?|non|aucune?|sans"
_NOT_BEFORE = re.compile(rf"\b({_NO})\W*$", re.IGNORECASE)
_NOT_AFTER = re.compile(rf"\W*(({_NO})\b|0+([.,]0*)?(?![\d.,]))", re.IGNORECASE)
"""Words around these that say that it was not done, or by 0."""


def is_altered(text: str) -> bool:
    """Return whether a text says that values were corrected, shifted or normalised."""
    return any(
        not _NOT_BEFORE.search(text[: match.start()]) and not _NOT_AFTER.match(text[match.end() :])
        for match in _ALTERED.finditer(text)
    )


def said_to_be_altered(above: Sequence[Sequence[str]], names: Sequence[str]) -> tuple[str, ...]:
    """Return the lines that say that values were corrected, shifted or normalised.

    Parameters
    ----------
    above : sequence of sequences of str
        Fields of the lines above the rows, without marks of comments.
    names : sequence of str
        Of the columns; a line of these says nothing of the others.
    """
    facts = [
        " ".join(filter(None, line))
        for line in above
        if not all(any(text in name for name in names) for text in line)
    ]
    return tuple(f"above the rows: {fact[:80]!r}" for fact in facts if is_altered(fact))


def comments_between(path: Path, mark: str | None, encoding: str, first: int) -> tuple[str, ...]:
    """Return the comments in a file after its first row, each once.

    Parameters
    ----------
    path : Path
        Of the file.
    mark : str, optional
        With which a comment begins.
    encoding : str
        Of the file.
    first : int
        Line of the first row, counted from 0.
    """
    # Comments with different words; more are a column of their own.
    most = 3
    # In UTF-16 a byte of a character may be a line's end.
    if mark is None or encoding.startswith("utf-16"):
        return ()
    remarks: dict[str, str] = {}
    with open(path, "rb") as file, mmap.mmap(file.fileno(), 0, access=mmap.ACCESS_READ) as text:
        # Some files of old end their lines with a carriage return alone.
        end = b"\n" if text.find(b"\n") >= 0 else b"\r"
        counted_to, line, rows = 0, 0, _place_of(text, first, end)
        comment = re.compile(re.escape(mark.encode()) + rb"([^\r\n]*)")
        above: set[bytes] = set()
        for match in comment.finditer(text):
            if not _begins_a_line(text, match.start()):
                continue
            if match.start() < rows:
                above.add(match[1])
                continue
            words = match[1].decode(encoding, errors="replace").strip()
            # A header that comes again says nothing new, and a rule of signs nothing at all.
            if match[1] in above or not re.search(r"[^\W\d_]", words) or words in remarks:
                continue
            place = match.start()
            line += text[counted_to:place].count(end)
            counted_to = place
            remarks[words] = f"in line {line + 1}: {words[:80]!r}"
            if len(remarks) == most:
                break
    return tuple(remarks.values())


def _place_of(text: mmap.mmap, line: int, end: bytes) -> int:
    """Return the first byte of a line, counted from 0, where each has some end."""
    place = 0
    for _ in range(line):
        place = text.find(end, place) + 1
    return place


def _begins_a_line(text: mmap.mmap, place: int) -> bool:
    """Return whether only blanks stand before a place in its line."""
    # Bytes that are looked at, as most lines are short.
    before = text[max(place - 80, 0) : place]
    return re.search(rb"(\A(\xef\xbb\xbf)?|[\r\n])[ \t]*\Z", before) is not None
