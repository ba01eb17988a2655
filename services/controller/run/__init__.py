"""Run of a task: state machine, supervisor, requests, goals, progress and snag detection."""
