"""Environments to train policies in: seeded scenes, and rope shaping by Gymnasium's interface."""
