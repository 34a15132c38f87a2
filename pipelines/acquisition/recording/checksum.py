"""The checksum of a journal's batch, which distinguishes a damaged batch from a written one.

It is text in the batch's own metadata, which other readers of Arrow ignore. It covers every byte of
the batch, with the text's own digits as zeros, and the journal's head, which names the columns.
"""

import re
from zlib import crc32

KEY = b"checksum"
"""Key of the checksum in a batch's own metadata."""
BLANK = b"exoid-batch:00000000"
"""Its value while it is computed."""
_CHECKSUM = re.compile(rb"exoid-batch:([0-9a-f]{8})")


def with_checksum(batch: bytes, head: bytes) -> bytes:
    """Return a batch of a stream with its checksum in place of ``BLANK``.

    Parameters
    ----------
    batch : bytes
        With ``BLANK`` in its metadata.
    head : bytes
        The stream's head, which the checksum covers too.
    """
    # Metadata come before the columns, so the first occurrence is the right one.
    place = batch.index(BLANK) + len(BLANK) - 8
    return b"%b%08x%b" % (batch[:place], crc32(batch, crc32(head)), batch[place + 8 :])


def fits(batch: bytes, head: bytes) -> bool:
    """Return whether a batch has the checksum of its bytes and its head.

    Parameters
    ----------
    batch : bytes
        As read from a journal.
    head : bytes
        The journal's head.
    """
    match = _CHECKSUM.search(batch)
    if match is None:
        return False
    begin, end = match.span(1)
    return crc32(batch[:begin] + b"00000000" + batch[end:], crc32(head)) == int(match[1], 16)
