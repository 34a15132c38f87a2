"""Recordings: the journal of a run, and the file that it becomes."""
