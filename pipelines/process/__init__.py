"""The process of exoid: its event loop, and the signals that end it."""
