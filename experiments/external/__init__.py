"""Bring your own: images, estimators, renderers and kept references, judged like ours."""
