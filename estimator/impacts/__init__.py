"""Flights that meet at an impact: where impacts are, what touches, and the fit of all pieces together."""
