"""Levenberg-Marquardt, starts, covariance."""
