"""Diagnosis: what the simulation gets wrong, its physical cause, and what naming it gains."""
