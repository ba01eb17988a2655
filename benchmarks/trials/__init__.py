"""Trials: many seeded scenes, each a whole run, and what arms and rope really did in it."""
