"""The free flight of a rigid body."""
