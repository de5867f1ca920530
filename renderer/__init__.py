"""Nusselt's renderer: direct lighting in pure NumPy, float64, vectorised.

Read `scene` (what is rendered), one of `estimators` (how), and `image` (the whole).
"""
