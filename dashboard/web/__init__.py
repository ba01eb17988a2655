"""Door of the page: the only server that a browser reaches; it decides whom it admits."""
