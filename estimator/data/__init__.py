"""What is passed between the rooms: settings, views, sightings, what a fit needs, and why there is no measurement."""
