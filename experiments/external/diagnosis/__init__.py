"""What kind of mistake an image looks like: hypotheses, each rendered with its defect, and what each leaves."""

from .case import Inputs
from .diagnose import Diagnosis, diagnose

__all__ = ["Diagnosis", "Inputs", "diagnose"]
