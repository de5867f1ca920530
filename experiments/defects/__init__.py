"""Wrong renderers, each a few lines over the right one, with the scene that can show it."""
