"""Epipolar tangency error, visual hull and mass properties."""
