"""The checksum of a journal's batch, by which one that a disk has damaged is known from one that
was written so.

It stands as text in the batch's own metadata, where other readers of Arrow pass over it, and covers
every byte of the batch, the text's own digits taken as zeros, and the journal's head, without which
no column has a name.
"""

import re
from zlib import crc32

KEY = b"checksum"
"""Key under which a batch's own metadata hold it."""
BLANK = b"exoid-batch:00000000"
"""How it stands there before it is known."""
_STATED = re.compile(rb"exoid-batch:([0-9a-f]{8})")


def with_checksum(batch: bytes, head: bytes) -> bytes:
    """Return a batch as a stream has it, the checksum put in where it is ``BLANK``."""
    place = batch.index(BLANK) + len(BLANK) - 8
    return b"%b%08x%b" % (batch[:place], crc32(batch, crc32(head)), batch[place + 8 :])


def fits(batch: bytes, head: bytes) -> bool:
    """Return whether a batch is what was written after this head."""
    stated = _STATED.search(batch)
    if stated is None:
        return False
    begin, end = stated.span(1)
    return crc32(batch[:begin] + b"00000000" + batch[end:], crc32(head)) == int(stated[1], 16)


def has_any(content: bytes) -> bool:
    """Return whether a part of a journal holds a checksum: those of an older exoid have none."""
    return _STATED.search(content) is not None
