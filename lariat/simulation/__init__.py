"""Simulated lab: ropes as plants, and an RGB-D camera that sees them."""
