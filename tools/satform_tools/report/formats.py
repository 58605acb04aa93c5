# Copyright 2026 satform contributors
# SPDX-License-Identifier: Apache-2.0
"""The forms in which a flight is written besides its page; apart, so that the command line loads quickly."""

from enum import StrEnum


class Format(StrEnum):
    """A form in which a flight is written."""

    PNG = "png"
    SVG = "svg"
    PDF = "pdf"
    CSV = "csv"
    PARQUET = "parquet"
