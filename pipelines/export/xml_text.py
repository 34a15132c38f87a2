"""XML that no name and no comment can break."""

import re
from collections.abc import Iterable
from xml.etree import ElementTree as ET

from pipelines.export.language import one_line


def document(root: ET.Element, comment: Iterable[str]) -> str:
    """Return an XML document that begins with a comment."""
    ET.indent(root)
    text = "\n".join(f"  {line}".rstrip() for line in map(one_line, comment))
    # Two hyphens end a comment, and so does one before its end.
    safe = re.sub(r"-(?=-)", "- ", text)
    return (
        '<?xml version="1.0"'
        f' encoding="utf-8"?>\n<!--\n{safe}\n-->\n{ET.tostring(root, encoding="unicode")}\n'
    )


def number(value: float) -> str:
    """Write a number so that it is read back as it was."""
    return repr(float(value))


def numbers(*values: float) -> str:
    """Write numbers so that they are read back as they were."""
    return " ".join(map(number, values))
