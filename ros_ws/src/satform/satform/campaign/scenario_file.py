# Copyright 2026 satform contributors
# SPDX-License-Identifier: Apache-2.0
"""The scenario that a campaign names: found, read and checked together with the campaign."""

from dataclasses import dataclass, field
from pathlib import Path, PurePath
from typing import Any

from pydantic import GetCoreSchemaHandler, GetJsonSchemaHandler
from pydantic_core import CoreSchema, PydanticCustomError, core_schema

from satform.files.bounded_file import is_file
from satform.files.named_file import FileSource
from satform.scenario import Scenario, ScenarioError, load_scenario

_SUFFIXES = (".yaml", ".yml", ".json")


@dataclass(frozen=True)
class CampaignSource(FileSource):
    """Where the scenario of a campaign is looked for.

    Attributes:
        library: folder of the shipped scenarios; None where there is none.
    """

    library: Path | None = None

    def find(self, name: str) -> Path:
        """The file of a scenario.

        Args:
            name: a path from the folder of the campaign's file, or the name of a scenario.

        Returns:
            The file; for a name the first of those in the campaign's folder, in the folder above it and in
            the library.

        Raises:
            ValueError: there is none of that name.
        """
        if PurePath(name).suffix in _SUFFIXES or "/" in name:
            return self.folder / name
        folders = [self.folder, self.folder / "..", *([self.library] if self.library else [])]
        for folder in folders:
            if is_file(folder / f"{name}.yaml"):
                return folder / f"{name}.yaml"
        looked = " nor ".join(str(folder) for folder in folders)
        raise ValueError(
            f"there is no scenario {name!r}: neither in {looked} is a file {name}.yaml. Give the name of a "
            "shipped scenario, or the path of a file from the folder of the campaign"
        )


@dataclass(frozen=True)
class NamedScenario:
    """A scenario as it was when its campaign was read.

    Attributes:
        name: as the campaign has it.
        scenario: validated.
    """

    name: str
    scenario: Scenario = field(repr=False)

    def renamed(self, name: str) -> "NamedScenario":
        """The same scenario under another name."""
        return NamedScenario(name, self.scenario)

    @classmethod
    def __get_pydantic_core_schema__(cls, _source: Any, _handler: GetCoreSchemaHandler) -> CoreSchema:
        return core_schema.with_info_plain_validator_function(
            cls._validated,
            serialization=core_schema.plain_serializer_function_ser_schema(lambda named: named.name),
        )

    @classmethod
    def __get_pydantic_json_schema__(
        cls, _schema: CoreSchema, _handler: GetJsonSchemaHandler
    ) -> dict[str, Any]:
        return {"type": "string", "minLength": 1}

    @classmethod
    def _validated(cls, value: Any, info: core_schema.ValidationInfo) -> "NamedScenario":
        if isinstance(value, NamedScenario):
            return value
        if isinstance(value, Scenario):
            return cls(value.name, value)
        if not isinstance(value, str | PurePath) or not str(value):
            raise ValueError(f"found {value!r}; it should be the name or the path of a scenario")
        source = info.context if isinstance(info.context, CampaignSource) else CampaignSource()
        path = source.find(str(value))
        try:
            return cls(str(value), load_scenario(path))
        except ScenarioError as error:
            # The loader takes these as they are: they have places in the scenario's own file.
            raise PydanticCustomError(
                "scenario", "{summary}", {"summary": str(error), "problems": error.problems}
            ) from None
