"""Effects of the stage "tracking", one per file."""
