"""Rules that every motion must keep, the motion of commands under them, and the guard of a cell."""
