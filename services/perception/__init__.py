"""Perception: node chains of the rope from RGB-D frames, and the scene of obstacles."""
