"""The commands of the emulated arm, one file for each matter that they are about."""
