"""Benchmarks, page tools, and measurements from before the one frame of studies, in rooms by purpose."""
