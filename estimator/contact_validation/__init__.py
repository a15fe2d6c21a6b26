"""Contact models held against measured impacts: how well each predicts those it was not fitted to, and which physics is missing."""
