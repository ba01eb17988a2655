"""Coverage of the stated standard deviations of what is learnt about a rope."""
