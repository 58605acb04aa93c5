"""Equipment of a satellite and what the flight software makes of it."""
