"""Run of a task: state machine, requests, goals and reasons."""
