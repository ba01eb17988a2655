"""Planning of whole paths for both ends of a rope, past obstacles, within the arms' limits."""
