"""Effects of the stage "body", one per file."""
