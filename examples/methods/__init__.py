"""Methods and an arm of one's own, which the examples put into the stack."""
