"""What a light sends to a point, without noise: formulas, each with the domain in which it keeps its digits.

`irradiance` and `phong_lobe` choose among them per point and give every value with a bound of its relative error;
`sun_irradiance` does a disk at infinity. The other modules are what these are made of.
"""
