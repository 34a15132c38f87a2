"""Acquisition: move the leg along an excitation on whatever a rig file describes, and keep every
sample."""
