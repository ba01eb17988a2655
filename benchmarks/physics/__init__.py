"""The rod against closed-form solutions."""
