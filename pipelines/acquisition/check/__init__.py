"""Checks whether a rig agrees with its file: by reading, by hand, and by a small movement."""
