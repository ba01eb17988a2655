"""Film of recorded runs: pictures drawn from their messages, as a video or a GIF."""
