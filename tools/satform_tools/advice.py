"""The warnings of `check`, under their earlier name."""

from satform_tools.check import warnings
from satform_tools.check.consensus import margin

__all__ = ["margin", "warnings"]
