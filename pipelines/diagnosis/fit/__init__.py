"""The named causes fitted with the baseline, and what the fit says on other runs."""
