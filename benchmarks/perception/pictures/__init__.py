"""Rendered pictures of cables with instance labels, for tests and `lariat bench perception`."""
