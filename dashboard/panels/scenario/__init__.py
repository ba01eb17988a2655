"""Tab of the scenario: choose, change, start and save scenarios."""
