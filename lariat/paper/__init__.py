"""Methods of the paper: horizon by Adam on a network or on velocities, adaptation by eq. (15)."""
