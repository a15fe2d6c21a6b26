"""Silhouettes as a kind of measurement: what is noise in them, where they miss a model, and what others would look like."""
