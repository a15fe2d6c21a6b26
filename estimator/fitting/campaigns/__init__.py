"""Several sequences fitted at once: shared effects, covariance, errors held out."""
