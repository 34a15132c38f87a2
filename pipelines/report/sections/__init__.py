"""The sections of a report, one a file: values of the page's template, from a session."""
