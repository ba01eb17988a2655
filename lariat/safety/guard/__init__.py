"""Safety of a cell: state machine, stop causes, watchdog, force limit, orderly shutdown, log."""
