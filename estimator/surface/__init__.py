"""The body's surface as an unknown beside the motion: every sample of every outline against the outline that the surface casts."""
