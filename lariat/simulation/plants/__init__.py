"""Plants: simulations of the true rope, by MuJoCo in two ways, or by Lariat's own rod."""
