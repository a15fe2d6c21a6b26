"""One picture: background, light, and where the outline runs between pixels."""
