"""Recordings of others: what the tool finds in them."""
