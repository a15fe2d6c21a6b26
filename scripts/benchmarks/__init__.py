"""How long things take and how large they are: ``tumble bench``, and pages of what was measured."""
