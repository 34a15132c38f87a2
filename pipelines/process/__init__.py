"""The process that exoid runs in: its event loop, and the signals that end it."""
