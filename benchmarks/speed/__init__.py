"""Speed: runs, the live stack, its start, the page, hours of work."""
