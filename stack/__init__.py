"""The services of a cell as a whole: live processes, simulated time, replay, and a client."""
