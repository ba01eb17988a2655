"""Ways through posts, beams, windows, corridors and clutter: `lariat bench narrow`."""
