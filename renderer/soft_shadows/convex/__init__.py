"""Exact visibility: shadows of extended lights without noise, by strips of the light's own square.

In the order of the work: `convex`, `convex_decomposition` (a scene's triangles as convex pieces), `occluders` and
`round_bodies` (those before a light, and on which side of them a point is), `shaft` and `candidates` (those that can
matter to a block of points, and to each), `sections` and `conics` (what each hides, in the light's square), `breaks`
and `strips` (what is left, as trapezoids), `rims` (as arcs), `integrals` (irradiance and the lobes over arcs: their
sums, with bounds), `quad` (the routes). The arcs' closed forms are those of `closed_forms.circles`.
"""
