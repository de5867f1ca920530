"""A second renderer, which shares no line with the first: NumPy alone, its own reader, its own algorithms.

The project's verdicts are tried with its images: right ones, made in many ways, and wrong ones, each by one mistake.
"""
