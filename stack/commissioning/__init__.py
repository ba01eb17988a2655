"""First day of a cell: a checklist of checked steps, whose results stay with the cell."""
