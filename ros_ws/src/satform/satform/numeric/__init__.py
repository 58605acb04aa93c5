"""Arithmetic with reproducible bits: element-wise vector algebra, stacking of dataclasses, time derivatives.

Imports `common` only.
"""
