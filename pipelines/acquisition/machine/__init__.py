"""The machine: drives, force sensors, and how they are sampled."""
