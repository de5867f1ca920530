"""Surfaces as arrays."""
