"""Kinds of measurement that a campaign can be made of: silhouettes in pictures, and trajectories."""
