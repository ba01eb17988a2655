"""Grid search for a path through narrow places, with the rope carried in a few fixed shapes."""
