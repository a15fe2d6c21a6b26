"""Where a model fails, whether there is anything to explain, and which effect explains it."""
