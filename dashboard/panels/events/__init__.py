"""Tab with what happened: log lines, holds, refusals, ends of runs."""
