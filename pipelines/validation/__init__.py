"""Explains what is wrong in a file that a user wrote."""
