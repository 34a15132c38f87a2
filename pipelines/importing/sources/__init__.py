"""Logs of every format, each as named columns."""
