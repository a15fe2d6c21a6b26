"""Outlines sample by sample as a kind of measurement: residuals are what the body's surface misses them by, the surface an unknown."""
