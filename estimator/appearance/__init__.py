"""Pose, surface and effects: the outline that is seen, its errors and their derivatives."""
