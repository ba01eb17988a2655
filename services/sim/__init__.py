"""Stand-in for the lab: a rope, obstacles, an RGB-D camera."""
