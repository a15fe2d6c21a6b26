"""What each study measures: its settings, its cases and its task. A committed result carries the digest of these files."""
