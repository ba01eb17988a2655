"""Bidirectional search for a path of both grips, with turns and bends, by random trees."""
