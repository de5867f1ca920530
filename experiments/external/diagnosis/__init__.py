"""What kind of mistake an image looks like: hypotheses, each rendered with its defect, ranked by what they explain."""

from .diagnose import Diagnosis, diagnose
from .hypotheses import HYPOTHESES

__all__ = ["HYPOTHESES", "Diagnosis", "diagnose"]
