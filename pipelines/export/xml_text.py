"""XML documents and numbers in them, safe for any name and comment."""

import re
from collections.abc import Iterable
from xml.etree import ElementTree as ET

from pipelines.export.language import one_line


def document(root: ET.Element, comment: Iterable[str]) -> str:
    """Return an XML document with a comment at the top."""
    ET.indent(root)
    text = "\n".join(f"  {line}".rstrip() for line in map(one_line, comment))
    # Two hyphens are not allowed in a comment, nor is one at its end.
    safe = re.sub(r"-(?=-)", "- ", text)
    body = ET.tostring(root, encoding="unicode")
    return f'<?xml version="1.0" encoding="utf-8"?>\n<!--\n{safe}\n-->\n{body}\n'


def number(value: float) -> str:
    """Return a number with all its digits."""
    # repr gives the shortest text that reads back as the same number.
    return repr(float(value))


def numbers(*values: float) -> str:
    """Return numbers with all their digits."""
    return " ".join(map(number, values))
