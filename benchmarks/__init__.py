"""Benches: measurements of the whole system and its parts, run by `lariat bench NAME`."""
