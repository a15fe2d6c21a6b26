"""From calibrated views to the particle: its hull, its mass properties, and what is wrong with a view."""
