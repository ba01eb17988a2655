"""Right-hand panel: camera image, plots, parameters, health."""
