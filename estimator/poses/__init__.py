"""One picture and the calibrated views: poses of the particle, from starts all around to a refined few."""
