"""The sections of a report, one a file; each has a function ``context`` (see ``section.py``)."""
