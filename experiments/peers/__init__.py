"""Other renderers on our scenes: independent peers, each run in its own environment."""
