"""Effects of the stage "segmentation", one per file."""
