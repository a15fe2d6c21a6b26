"""From pictures to outlines: background, sub-pixel contour, tracking through the sequence."""
