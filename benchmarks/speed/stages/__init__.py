"""Time by stage of the loop, from samples of the running processes."""
