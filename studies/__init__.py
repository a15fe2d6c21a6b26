"""Studies: questions that are answered by many sequences, all in one frame (decision 70). ``python -m studies --list`` names them."""
