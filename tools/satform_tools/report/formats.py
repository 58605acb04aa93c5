# Copyright 2026 satform contributors
# SPDX-License-Identifier: Apache-2.0
"""Formats of exports and of checks; apart from what writes them, so that the command line imports quickly."""

from enum import StrEnum


class Format(StrEnum):
    """An export format."""

    PNG = "png"
    SVG = "svg"
    PDF = "pdf"
    CSV = "csv"
    PARQUET = "parquet"


class FlightFormat(StrEnum):
    """An export format of a flight; an enumeration cannot be extended by the two that a campaign has not."""

    PNG = "png"
    SVG = "svg"
    PDF = "pdf"
    CSV = "csv"
    PARQUET = "parquet"
    OEM = "oem"
    OMM = "omm"


class CheckFormat(StrEnum):
    """How `check` prints what it has found."""

    TEXT = "text"
    JSON = "json"
    GITHUB = "github"
    SARIF = "sarif"
