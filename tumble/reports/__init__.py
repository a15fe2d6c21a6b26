"""Reports: one self-contained HTML page from saved results."""
