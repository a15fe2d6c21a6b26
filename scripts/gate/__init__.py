"""What the regression gate is tried on."""
