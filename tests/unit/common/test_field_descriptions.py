# Copyright 2026 satform contributors
# SPDX-License-Identifier: Apache-2.0
"""What docstrings below fields say, as descriptions of the fields."""

from typing import Annotated

from pydantic import Field

from satform.common.spec import Spec, field_description


class Body(Spec):
    mass: float = 1.0
    """Mass, kg;
    of the whole."""
    area: Annotated[float, Field(description="Its own words.")] = 1.0
    """Area, m^2."""
    silent: float = 1.0
    colour: str = "red"
    """Colour."""


class Inner(Body):
    colour: str = "blue"
    volume: float = 1.0
    """Volume, m^3."""


EXPECTED = {
    "mass": "Mass, kg;\nof the whole.",
    "area": "Its own words.",
    "silent": "",
    "colour": "",
    "volume": "Volume, m^3.",
}


def test_a_field_is_described_by_its_own_words_else_by_its_docstring_else_not() -> None:
    assert {name: field_description(Inner, name) for name in Inner.model_fields} == EXPECTED
    assert field_description(Body, "colour") == "Colour."


def test_the_json_schema_says_the_same() -> None:
    properties = Inner.model_json_schema()["properties"]
    assert {name: field.get("description", "") for name, field in properties.items()} == EXPECTED


def test_a_class_within_a_function_is_found() -> None:
    class Local(Spec):
        gain: float = 1.0
        """Gain, 1/s."""

    assert field_description(Local, "gain") == "Gain, 1/s."


def test_a_class_without_a_source_is_not_described() -> None:
    made = type("Made", (Spec,), {"__module__": "nowhere", "__annotations__": {"gain": float}, "gain": 1.0})
    assert field_description(made, "gain") == ""
