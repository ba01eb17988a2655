"""Arms in the plan: check of their links and joints along a path, and residuals that avoid them."""
