"""Flights of the silhouette tier that studies are made of: bodies, the standard flight, and the task that makes, measures and scores."""
