"""Is the rig what its file says? Looked at from outside, then, if asked for, moved by hand or by
itself."""
