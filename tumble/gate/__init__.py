"""The regression gate at work: a set of small sequences of every kind is made, measured and scored, and told beside its baseline."""
