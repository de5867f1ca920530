"""Exact visibility: shadows of extended lights without noise, by strips of the light's own square.

In the order of the work: `convex`, `pieces` (a scene's triangles as convex pieces), `occluders` and `round_bodies`
(those before a light, and on which side of them a point is), `shaft` and `standing` (those that can matter to a block
of points, and to each), `sections`, `rounds` and `conics` (what each hides, in the light's square), `breaks` and
`strips` (what is left, as trapezoids), `rims` (as arcs), `kernels` (irradiance and the Phong lobe over arcs),
`integrals` (their sums, with bounds), `quad` (the routes).
"""
