"""What is left of a light behind occluders, without noise."""
