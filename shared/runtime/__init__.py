"""What every process runs on: the service contract, its loop, clock, health and logs."""
