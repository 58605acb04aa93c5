# Copyright 2026 satform contributors
# SPDX-License-Identifier: Apache-2.0
"""Lets the ROS interface generators of one build parse each interface once.

Ten generators run one after another, each in a Python of its own, and each parses every interface anew,
which takes more than half of their time. Python imports this module at its start where PYTHONPATH has its
folder, as in the build. What was parsed is stored in the folder of `SATFORM_PARSED_INTERFACES` under a hash
of the text.
"""

import hashlib
import importlib.abc
import importlib.util
import os
import pickle
import sys
from collections.abc import Callable, Sequence
from importlib.machinery import ModuleSpec
from pathlib import Path
from types import ModuleType
from typing import Any

_PARSER = "rosidl_parser.parser"


class _Parser(importlib.abc.MetaPathFinder):
    """Finds the parser of interfaces as it would be found without this, and has its results stored."""

    def find_spec(
        self, name: str, path: Sequence[str] | None, target: ModuleType | None = None
    ) -> ModuleSpec | None:
        """As the import system asks for it."""
        if name != _PARSER:
            return None
        sys.meta_path.remove(self)
        spec = importlib.util.find_spec(name)
        loader: Any = spec and spec.loader
        if loader:
            load = loader.exec_module

            def load_and_change(module: Any) -> None:
                load(module)
                module.parse_idl_string = _stored(module.parse_idl_string)

            loader.exec_module = load_and_change
        return spec


def _stored(parse: Callable[..., Any]) -> Callable[..., Any]:
    """The function that parses a text, or has it from an earlier process."""
    folder = Path(os.environ["SATFORM_PARSED_INTERFACES"])

    def parse_once(text: str, png_file: str | None = None) -> Any:
        file = folder / hashlib.sha256(text.encode()).hexdigest()
        try:
            return pickle.loads(file.read_bytes())  # noqa: S301 - this build has written it
        except OSError:
            content = parse(text, png_file=png_file)
        draft = file.with_suffix(f".{os.getpid()}")
        draft.write_bytes(pickle.dumps(content))
        draft.replace(file)
        return content

    return parse_once


if "SATFORM_PARSED_INTERFACES" in os.environ:
    sys.meta_path.insert(0, _Parser())
