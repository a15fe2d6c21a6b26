"""``tumble shape``: drops of calibrated silhouettes become one particle file."""
