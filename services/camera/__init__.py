"""RGB-D camera, real or recorded, in the place of the simulated one."""
