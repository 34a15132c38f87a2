"""Least squares on regressors, with intervals that survive autocorrelated residuals."""
