"""Film of recorded runs: a video and GIFs."""
