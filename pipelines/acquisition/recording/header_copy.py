"""Copies of a journal's head, which has columns and metadata: without it no sample can be read.

An Arrow stream has one head, at its beginning. Each copy is text in the metadata of a batch without
rows, which other readers of Arrow ignore.
"""

import re
from base64 import b64decode, b64encode
from typing import BinaryIO
from zlib import crc32

KEY = b"head"
"""Key of a copy in a batch's own metadata."""
_COPY = re.compile(rb"exoid-head:([0-9a-f]{8}):([A-Za-z0-9+/]+=*)")


def head_as_text(head: bytes) -> str:
    """Return a head as text with a checksum, which can be found in a damaged file."""
    return f"exoid-head:{crc32(head):08x}:{b64encode(head).decode()}"


def find_head(file: BinaryIO) -> bytes | None:
    """Return the head of the first undamaged copy in a journal; None for none."""
    # Bytes at the beginning and at the end of a journal that are searched for a copy.
    searched = 2**20
    length = file.seek(0, 2)
    for place in (0, max(length - searched, 0)):
        file.seek(place)
        for match in _COPY.finditer(file.read(searched)):
            try:
                head = b64decode(match[2])
            except ValueError:
                continue
            if crc32(head) == int(match[1], 16):
                return head
    return None
