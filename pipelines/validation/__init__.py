"""Explain errors in files that users write."""
