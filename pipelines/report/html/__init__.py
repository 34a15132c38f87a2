"""HTML pages: the report of one session, and the comparison of two."""
