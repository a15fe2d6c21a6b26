"""``tumble calibrate``: pictures of targets, or others' calibration files, become a calibration and a page to look at."""
