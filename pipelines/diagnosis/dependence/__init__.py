"""Dependences of a residual that no listed cause explains."""
