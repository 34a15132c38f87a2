"""Acquisition: move the leg along an excitation on the rig of a file, and keep every sample."""
