"""Compiled forward dynamics of any model, and the closed loops built on it."""
