"""Which sizes of each cause a motion and a noise level would reveal."""
