"""Services in simulated time: runner, closed loop, score, emulated arms."""
