"""Logs in workbooks of Excel (.xlsx)."""

import csv
import re
from collections.abc import Iterable
from datetime import date, time
from decimal import Decimal
from functools import cache
from io import StringIO
from pathlib import Path
from typing import Any

from pipelines.errors import InputError
from pipelines.importing.sources.extra import library
from pipelines.importing.sources.source import Source
from pipelines.importing.sources.text import open_lines
from pipelines.settings.import_map import SourceSettings
from pipelines.validation.suggestion import suggestion


def open_excel(path: Path, settings: SourceSettings) -> Source:
    """Return the log in a workbook; ``source.table`` names its sheet if several have a table.

    Raises
    ------
    InputError
        If it is damaged, or no sheet or several have a table of numbers.
    """
    openpyxl = library("openpyxl")
    try:
        book = openpyxl.load_workbook(path, read_only=True, data_only=True)
        sheets = {sheet.title: sheet for sheet in book.worksheets}
        if settings.table is not None and settings.table not in sheets:
            raise InputError(
                f"has no sheet {settings.table!r}, which source.table names; "
                f"{suggestion(settings.table, list(sheets))}"
            )
        texts = {
            title: _text(sheet.iter_rows())
            for title, sheet in sheets.items()
            if settings.table in (None, title)
        }
        book.close()
    except InputError:
        raise
    except Exception as error:  # the library raises errors of any class for a damaged file
        raise InputError(f"is a damaged workbook ({error}); save it again") from error
    as_text = settings.model_copy(update={"delimiter": "\t", "encoding": "utf-8"})
    tables: dict[str, Source] = {}
    problem = InputError("has no sheet of cells; save the table again")
    for title, text in texts.items():
        try:
            tables[title] = open_lines(path, "Excel", text, as_text)
        except InputError as error:
            problem = error
    if len(tables) > 1:
        raise InputError(f"has tables in {', '.join(tables)}; name one in the map: source.table")
    if not tables:
        raise problem
    return next(iter(tables.values()))


def _text(rows: Iterable[tuple[Any, ...]]) -> str:
    """Return rows of cells as text with tabs between the fields."""
    lines = StringIO()
    csv.writer(lines, delimiter="\t", lineterminator="\n").writerows(map(_cells, rows))
    return lines.getvalue()


def _cells(row: tuple[Any, ...]) -> list[str]:
    return [
        value.isoformat() if isinstance(value, date | time) else " ".join(str(value).split())
        for value in ("" if cell.value is None else _shown(cell) for cell in row)
    ]


def _shown(cell: Any) -> Any:
    """Return the value of a cell as Excel shows it: 0.153 as 15.3 %, 1830 as 1.83 thousand."""
    is_number = isinstance(cell.value, int | float) and not isinstance(cell.value, bool)
    if is_number and (tens := tens_shown(cell.number_format)):
        return Decimal(repr(cell.value)).scaleb(tens)
    return cell.value


@cache
def tens_shown(number_format: str) -> int:
    """Return by how many powers of ten Excel shifts a number: 2 for each %, -3 for a last comma.

    A comma scales where it follows the last place for a digit; among places it parts thousands.
    """
    # Without mere text, colours and conditions; another section is for other signs.
    bare = re.sub(r'"[^"]*"|\\.|_.|\*.|\[[^]]*\]', "", number_format).partition(";")[0]
    last = re.search(r"[0#?](,+)(?=[^0#?,]*$|\.)", bare)
    return 2 * bare.count("%") - 3 * (len(last[1]) if last else 0)
