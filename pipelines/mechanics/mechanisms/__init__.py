"""Mechanisms, one file each; docs/mechanisms.md explains how to add one."""
