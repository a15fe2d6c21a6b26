"""Studies: one file each, reproducing a figure or answering a question."""
