"""Columns of a log as physical quantities: units, signs, counters, expressions."""
