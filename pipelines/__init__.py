"""exoid: identification experiments on an exoskeleton leg, as a library."""

__version__ = "0.1.0"
