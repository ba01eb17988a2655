"""Plants: simulations of the true rope, by MuJoCo or by Lariat's own rod."""
