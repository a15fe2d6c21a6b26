"""Several sets of calibrated silhouettes of one particle, the orientation between the sets unknown, merged into one set."""
