"""Silhouettes as a kind of measurement."""
