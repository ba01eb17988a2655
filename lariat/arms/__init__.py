"""Arms of any make: kinematics and collision bodies from a URDF."""
