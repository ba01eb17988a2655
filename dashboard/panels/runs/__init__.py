"""Tab with the runs that the recorder has kept."""
