"""Benchmark sets: named, versioned, with a card, a manifest and the list of what is to be measured."""
