"""Effects of the stage "optics", one per file."""
