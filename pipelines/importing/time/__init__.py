"""Clock and period of a log."""
