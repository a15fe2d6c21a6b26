"""Recipes: what to make, as data. Closed to the estimator."""
