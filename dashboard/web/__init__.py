"""Web server of the page: the only one that a browser reaches; it decides whom it admits."""
