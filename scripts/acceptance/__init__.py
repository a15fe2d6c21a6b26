"""Whole measurements against the truth, by kind of recording, and their pages."""
