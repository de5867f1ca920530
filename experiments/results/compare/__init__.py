"""Runs compared: what changed beyond noise between two, and in which of several."""

from .comparison import Comparison, compare_rows
from .files import compare
from .history import History

__all__ = ["Comparison", "History", "compare", "compare_rows"]
