"""Nature: meshes, exact motion, Mitsuba optics and the sensor. Writes observations and truth."""
