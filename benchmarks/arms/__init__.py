"""Scenes in which arms may hit obstacles and each other: `lariat bench arms`."""
