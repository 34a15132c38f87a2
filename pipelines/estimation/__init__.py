"""Estimate parameters from regressors, with intervals valid for autocorrelated residuals."""
