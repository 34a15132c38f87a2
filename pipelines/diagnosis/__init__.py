"""Diagnosis: where the simulation is wrong, the physical cause, and the gain from naming it."""
