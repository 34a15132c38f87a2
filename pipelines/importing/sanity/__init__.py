"""Whether what was imported can be the motion of a machine."""
