"""What runs in Mitsuba's own process: the only files that import it."""
