"""The mechanisms that there are: one file each, and nothing else to edit (docs/mechanisms.md tells
what it holds)."""
