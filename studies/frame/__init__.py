"""What all studies share: settings, cases that are measured once and kept, the result with what it was made with, page and picture."""
