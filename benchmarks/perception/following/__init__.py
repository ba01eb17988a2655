"""Following of a held rope beside other ropes, behind hands and beyond the view."""
