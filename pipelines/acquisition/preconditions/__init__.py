"""Checks that must pass before a drive is enabled."""
