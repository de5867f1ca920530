"""A hunt: random scenes for a renderer, what fails made small, and one cause told once."""
