"""Journals, read as tests want them."""

import pyarrow as pa

from pipelines.acquisition.recording.journal_file import JournalFile, in_pieces


def read_journal(path):
    """Return all rows of a journal as a frame, and its metadata."""
    journal = JournalFile(path)
    pieces = [
        journal.schema.empty_table(),
        *in_pieces((batch.rows for batch in journal.batches()), 1000),
    ]
    return pa.concat_tables(pieces).to_pandas(), journal.metadata
