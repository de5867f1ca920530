"""Closed forms over what circles and ellipses bound."""
