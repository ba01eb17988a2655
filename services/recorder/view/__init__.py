"""Drawing of the cell in the standard types of viewers such as Foxglove and Rerun."""
