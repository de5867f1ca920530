"""Is the image right, and how sure are we? Rules over evidence; see `judge` and `rules`."""
