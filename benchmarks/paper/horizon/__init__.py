"""Time to plan one horizon, and error of its prediction."""
