"""Particles: meshes from files or from a procedural family, their mass properties, shape descriptors and symmetries."""
