"""Optimisation of a quasi-static path of the grips, with the rod as the model of the rope."""
