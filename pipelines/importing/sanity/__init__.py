"""Check whether imported recordings can be the motion of a machine."""
