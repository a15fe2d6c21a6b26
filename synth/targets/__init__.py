"""Pictures of calibration targets, drawn exactly through a known camera."""
