"""Buttons for the run and the arms, and the status lines above them."""
