"""The named causes fitted with the baseline, and validated on other runs."""
