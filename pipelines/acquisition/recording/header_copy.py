"""The head of a journal, with columns and metadata, kept more than once: without it no sample can
be read.

An Arrow stream has one head, at its beginning. Each copy is text among the metadata of a batch
without rows, where other readers of Arrow pass over it.
"""

import re
from base64 import b64decode, b64encode
from collections.abc import Iterator
from typing import BinaryIO
from zlib import crc32

COPY = b"head"
"""Key under which a batch's own metadata hold a copy of the head."""
SEARCHED = 2**20
"""Bytes at the beginning and at the end of a journal in which a copy is looked for."""
_STATED = re.compile(rb"exoid-head:([0-9a-f]{8}):([A-Za-z0-9+/]+=*)")


def copy_of(head: bytes) -> str:
    """Return a head as text with a checksum, by which it is known in a file that is damaged
    anywhere else."""
    return f"exoid-head:{crc32(head):08x}:{b64encode(head).decode()}"


def ends_of(file: BinaryIO) -> Iterator[bytes]:
    """Yield the beginning and the end of a journal, as far as it is searched for what tells how to
    read it."""
    length = file.seek(0, 2)
    for place in (0, max(length - SEARCHED, 0)):
        file.seek(place)
        yield file.read(SEARCHED)


def head_in(file: BinaryIO) -> bytes | None:
    """Return the head that the first whole copy in a journal holds; None where there is none."""
    for content in ends_of(file):
        for stated in _STATED.finditer(content):
            try:
                head = b64decode(stated[2])
            except ValueError:
                continue
            if crc32(head) == int(stated[1], 16):
                return head
    return None
