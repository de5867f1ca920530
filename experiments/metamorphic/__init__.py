"""Is a renderer right, without a reference? Scenes that are the same, or a sum of others, must look so."""
