"""The main job: a question about a scene, and its answer."""
