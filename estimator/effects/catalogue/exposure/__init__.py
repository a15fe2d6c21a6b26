"""Effects of the stage "exposure", one per file."""
