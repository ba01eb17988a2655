"""Services of a cell put together: as processes, on simulated time or from a recording."""
