"""Which effects belong into the model: one marginal likelihood over sets of effects."""
