# Copyright 2026 satform contributors
# SPDX-License-Identifier: Apache-2.0
"""Files that a scenario names: read once with it, so that a run depends on what was in them then.

A field of type `NamedFile` holds a path in the scenario file, counted from that file's folder, and the
file's content once it is read. The digest of a scenario counts the content and not the name; a copy of
each file goes with every copy of the scenario.
"""

import hashlib
from collections.abc import Mapping
from dataclasses import dataclass, field
from pathlib import Path, PurePath
from typing import Any

from pydantic import BaseModel, GetCoreSchemaHandler, GetJsonSchemaHandler
from pydantic_core import CoreSchema, core_schema

from satform.files.bounded_file import read_bounded

MAXIMUM_BYTES = 20_000_000
"""A larger file is not read; sixty years of Earth orientation have 4 MB."""


@dataclass(frozen=True)
class FileSource:
    """Where the files of a scenario are looked for.

    Attributes:
        folder: from which relative paths count.
        attached: content of files by name, looked at first, such as those within a bag.
        recorded: whether the scenario is that of a recorded flight, whose expectations need no source.
    """

    folder: Path = Path()
    attached: Mapping[str, bytes] = field(default_factory=dict)
    recorded: bool = False


@dataclass(frozen=True)
class NamedFile:
    """A file as it was when its scenario was read.

    Attributes:
        name: as the scenario has it.
        content: of the file.
    """

    name: str
    content: bytes = field(repr=False)

    @property
    def digest(self) -> str:
        """SHA-256 of the content, hexadecimal."""
        return hashlib.sha256(self.content).hexdigest()

    @property
    def copy_name(self) -> str:
        """Name of a copy in one folder with the scenario: no two contents share it."""
        path = PurePath(self.name)
        mark = f"-{self.digest[:8]}"
        stem = path.stem.removesuffix(mark)
        return f"{stem}{mark}{path.suffix}"

    @classmethod
    def read(cls, name: str, source: FileSource) -> "NamedFile":
        """Read a file.

        Args:
            name: path of the file, absolute or from the source's folder.
            source: where to look.

        Raises:
            ValueError: there is no such file, or it cannot be read.
        """
        if name in source.attached:
            return cls(name, source.attached[name])
        try:
            path = source.folder / name
            return cls(name, read_bounded(path, MAXIMUM_BYTES, "such a file"))
        except OSError as error:
            where = "" if PurePath(name).is_absolute() else f" (in {source.folder.absolute()})"
            raise ValueError(f"the file {name}{where} cannot be read: {error.strerror}") from None
        except ValueError:
            raise ValueError(f"{name!r} is not a possible file name") from None

    @classmethod
    def __get_pydantic_core_schema__(cls, _source: Any, _handler: GetCoreSchemaHandler) -> CoreSchema:
        return core_schema.with_info_plain_validator_function(
            cls._validated,
            serialization=core_schema.plain_serializer_function_ser_schema(cls._serialised, info_arg=True),
        )

    @classmethod
    def __get_pydantic_json_schema__(
        cls, _schema: CoreSchema, _handler: GetJsonSchemaHandler
    ) -> dict[str, Any]:
        return {"type": "string", "format": "path"}

    @classmethod
    def _validated(cls, value: Any, info: core_schema.ValidationInfo) -> "NamedFile":
        if isinstance(value, NamedFile):
            return value
        if not isinstance(value, str | PurePath) or not str(value):
            raise ValueError(f"found {value!r}; it should be the path of a file")
        source = info.context if isinstance(info.context, FileSource) else FileSource()
        return cls.read(str(value), source)

    def _serialised(self, info: core_schema.SerializationInfo) -> str:
        if isinstance(info.context, _Copies):
            info.context.files[self.copy_name] = self.content
            return self.copy_name
        return f"sha256:{self.digest}" if info.context is BY_CONTENT else self.name


BY_CONTENT = object()
"""Context of a serialisation in which every file is its digest."""


@dataclass(frozen=True)
class _Copies:
    """Context of a serialisation in which every file is the name of its copy."""

    files: dict[str, bytes] = field(default_factory=dict)


def with_copies(model: BaseModel, **options: Any) -> tuple[str, dict[str, bytes]]:
    """A model as JSON text that names copies of its files.

    Args:
        model: with or without files.
        options: of pydantic's `model_dump_json`.

    Returns:
        The text, and the content of each copy by its name.
    """
    copies = _Copies()
    return model.model_dump_json(context=copies, **options), copies.files
