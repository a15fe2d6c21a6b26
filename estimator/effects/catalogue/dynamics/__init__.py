"""Effects of the stage "dynamics", one per file."""
