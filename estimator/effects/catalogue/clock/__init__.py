"""Effects of the stage "clock", one per file."""
