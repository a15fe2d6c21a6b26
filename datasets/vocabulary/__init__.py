"""The names both instruments share: cameras, clocks, states, outlines, bodies and frames of reference."""
