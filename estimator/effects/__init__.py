"""The reduced, differentiable models of the effects in the catalogue, one file each, and the protocol they follow."""
