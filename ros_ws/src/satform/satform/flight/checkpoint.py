# Copyright 2026 satform contributors
# SPDX-License-Identifier: Apache-2.0
"""The state of a satellite's flight software as bytes, from which it flies on with the same bits.

The file is written by `satform_nodes.satellite.checkpoint_file`.

The bytes hold numbers only, each under the name of its field (an npz archive without pickled
objects). The types come from the satellite that is restored, so that bytes from elsewhere can put
wrong numbers into it but nothing else.
"""

import dataclasses
import io
from dataclasses import replace
from typing import Any

import numpy as np
from numpy.typing import NDArray

from satform.attitude.guidance import Attitude, EstimatedAttitude
from satform.control.protocol import Motion
from satform.equipment.sensors.relative_motion import Measurement
from satform.files.numpy_archive import ArchiveError, read_archive
from satform.flight.satellite import Satellite

Numbers = dict[str, NDArray[Any]]

_OPTIONAL = frozenset({"memory", "estimate", "acceleration", "navigation", "attitude"})
"""Fields of a satellite's state that have no value before the first step."""


def save(satellite: Satellite) -> bytes:
    """The state of a satellite between two steps.

    Args:
        satellite: one, or several flown as one.

    Returns:
        What `restore` takes.

    Raises:
        TypeError: a part of the state is neither a dataclass nor numbers, as from a control law whose
            memory is of another kind.
    """
    encode: Numbers = {}
    _flatten(satellite.state, "", encode)
    buffer = io.BytesIO()
    np.savez(buffer, allow_pickle=False, **encode)
    return buffer.getvalue()


def restore(satellite: Satellite, data: bytes) -> None:
    """Put a satellite into the state that was saved.

    Args:
        satellite: of the same scenario as the one that was saved, with the same gains; its present
            state does not matter.
        data: from `save`.

    Raises:
        ValueError: the bytes are damaged, or belong to a satellite of another kind.
    """
    encode = _read(data)
    used: set[str] = set()
    state = _rebuilt(_template(satellite), "", encode, used)
    foreign = sorted(set(encode) - used)
    if foreign:
        raise ValueError(f"this checkpoint is of another kind of satellite: it holds {', '.join(foreign)}")
    satellite.state = state


def _template(satellite: Satellite) -> Any:
    """A state whose every part has its type and shape, with meaningless numbers."""
    plan = satellite.plan
    shape = (*np.shape(plan.arc_length), 3)
    motion = Motion(np.ones(shape), np.ones(shape))
    estimate, own = None, plan.attitude_filter
    if plan.estimator is not None:
        estimate = plan.estimator.start(Measurement(motion.position, motion.velocity, 0))
        # One item stands for all those of a tuple, which may have any length.
        estimate = replace(estimate, commands=(np.ones(shape),))
    return replace(
        satellite.state,
        memory=plan.controller.start(motion),
        estimate=estimate,
        acceleration=np.ones(shape),
        navigation=None if plan.navigation is None else plan.navigation.start(),
        attitude=None if own is None else EstimatedAttitude(own.blank(), Attitude(*(np.ones(shape),) * 3)),
    )


def _flatten(value: Any, name: str, encode: Numbers) -> None:
    if value is None:
        return
    if isinstance(value, tuple):
        for row, item in enumerate(value):
            _flatten(item, f"{name}.{row}", encode)
        return
    if dataclasses.is_dataclass(value):
        for field in dataclasses.fields(value):
            _flatten(getattr(value, field.name), f"{name}.{field.name}" if name else field.name, encode)
        return
    array = np.asarray(value)
    if array.dtype.kind not in "fiub":
        raise TypeError(f"{name} is a {type(value).__name__}: a state is made of dataclasses and numbers")
    encode[name] = array


def _rebuilt(template: Any, name: str, encode: Numbers, used: set[str]) -> Any:
    if template is None:
        return None
    if name in _OPTIONAL and not any(key == name or key.startswith(f"{name}.") for key in encode):
        return None
    if dataclasses.is_dataclass(template) and not isinstance(template, type):
        parts = {
            field.name: _rebuilt(
                getattr(template, field.name), f"{name}.{field.name}" if name else field.name, encode, used
            )
            for field in dataclasses.fields(template)
        }
        return replace(template, **parts)
    if isinstance(template, tuple):
        count = 0
        while f"{name}.{count}" in encode:
            count += 1
        return tuple(_rebuilt(template[0], f"{name}.{row}", encode, used) for row in range(count))
    if name not in encode:
        raise ValueError(f"this checkpoint is of another kind of satellite: {name} is missing")
    used.add(name)
    array, sample = encode[name], np.asarray(template)
    if array.shape != sample.shape or array.dtype != sample.dtype:
        raise ValueError(
            f"this checkpoint is of another kind of satellite: {name} is {array.dtype} of shape "
            f"{array.shape}, and {sample.dtype} of shape {sample.shape} is wanted"
        )
    # A number without axes goes on as the kind of object that it was: arithmetic on it is faster so.
    return type(template)(array) if isinstance(template, int | float | np.generic) else array


def _read(data: bytes) -> Numbers:
    try:
        return read_archive(data)
    except (OSError, ArchiveError) as error:
        raise ValueError(f"this is no checkpoint: {error}") from None
