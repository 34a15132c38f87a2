"""The sizes of each cause that a motion and a noise level reveal."""
