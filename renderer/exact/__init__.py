"""Exact visibility: shadows of extended lights without noise, by one-dimensional intervals on the visible contour.

In the order of the work: `convex`, `pieces` (a scene's triangles as convex pieces), `occluders` (those before a
light), `shaft` (those that can matter to a point), `light_cone`, `fans`, `lines`, `contour` (what is left of the light,
as arcs), `kernels` (irradiance and the Phong lobe over arcs), `quad` (the routes).
"""
