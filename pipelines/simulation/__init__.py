"""Simulation: the identified leg under the adaptive controller, and against its own recordings."""
