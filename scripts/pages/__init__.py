"""What writes pages about the code, and pages that a command's output is copied to."""
