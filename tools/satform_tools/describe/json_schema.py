# Copyright 2026 satform contributors
# SPDX-License-Identifier: Apache-2.0
"""Generates the JSON Schema of scenario files from the declarations that also validate them."""

import json
from typing import Any

from pydantic.json_schema import GenerateJsonSchema, JsonSchemaValue
from pydantic_core import core_schema

from satform.common.angle_text import PATTERNS
from satform.scenario import Scenario

DIALECT = "https://json-schema.org/draft/2020-12/schema"


def schema() -> dict[str, Any]:
    """The schema as data."""
    return {"$schema": DIALECT, **Scenario.model_json_schema(schema_generator=InputSchema)}


def text() -> str:
    """The schema as the text of `scenarios/scenario.schema.json`."""
    return json.dumps(schema(), indent=1, ensure_ascii=False) + "\n"


class InputSchema(GenerateJsonSchema):
    """Also allows what validators take besides: one number for all axes, text in degrees for an angle."""

    def function_before_schema(self, schema: core_schema.BeforeValidatorFunctionSchema) -> JsonSchemaValue:
        """What a validator takes, and what comes out of it."""
        inner = super().function_before_schema(schema)
        pattern = PATTERNS.get(schema["function"]["function"])
        if pattern is not None:
            return {"anyOf": [*inner.get("anyOf", [inner]), {"type": "string", "pattern": pattern}]}
        components = inner.get("prefixItems", [])
        if len(components) == 3 and all(component == components[0] for component in components):
            return {"anyOf": [components[0], inner]}
        return inner
