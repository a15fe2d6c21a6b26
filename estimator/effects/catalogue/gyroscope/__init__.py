"""Effects of the stage "gyroscope", one per file."""
