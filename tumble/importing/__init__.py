"""From a laboratory's own files to an observation: what is read, what was given, what is assumed, and what is missing."""
