"""Commands of the emulated arm, one file for each group."""
