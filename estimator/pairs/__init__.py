"""Two particles in one camera's pictures that collide once: whose outline is whose, both flights with one impact time, the collision."""
