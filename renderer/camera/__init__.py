"""From image points to what is seen."""
