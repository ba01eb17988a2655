"""Controllers and state estimators from outside, in the places of Lariat's own."""
