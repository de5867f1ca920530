"""One offline HTML file from a folder of results."""

from .page import write_report

__all__ = ["write_report"]
