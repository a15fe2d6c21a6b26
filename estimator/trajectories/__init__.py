"""Trajectories as measurements: their residuals, their noise, where fits start, and what is said of what is left."""
