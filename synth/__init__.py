"""Nature: particles, exact motion, optics and sensor. Writes what was observed and, apart from it, what was true."""
