"""Fits of one flight and of campaigns: tasks, Levenberg-Marquardt, the last refinement, covariance, what a calibration adds."""
