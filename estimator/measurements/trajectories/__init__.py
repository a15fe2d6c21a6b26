"""Trajectories and gyroscopes as a kind of measurement."""
