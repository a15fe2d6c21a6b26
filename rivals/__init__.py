"""Other ways to measure what `estimator` measures, for comparison. They know `datasets` alone: observations in, estimates out."""
