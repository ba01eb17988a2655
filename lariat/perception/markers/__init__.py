"""ArUco markers in images, and the obstacles that carry them."""
