# Copyright 2026 satform contributors
# SPDX-License-Identifier: Apache-2.0
"""What the bits of a result depend on: versions of the software, and the arithmetic of the machine."""

import functools
import hashlib
import math
import platform
from collections.abc import Iterator
from importlib.metadata import PackageNotFoundError, version
from typing import Any

import numpy as np
from numpy.typing import NDArray
from scipy.special import ndtr, ndtri

_SOFTWARE = ("satform", "numpy", "scipy", "brahe")


def arithmetic_digest() -> str:
    """Digest of results of functions whose last bits depend on the processor.

    numpy and LAPACK choose their code by the instructions that the processor has, the C library chooses its
    own too. Machines with unlike digests may give unlike results; with the same digest they probably do not.

    Returns:
        16 hexadecimal digits.
    """
    found = hashlib.sha256()
    for values in _results():
        found.update(np.ascontiguousarray(values).tobytes())
    return found.hexdigest()[:16]


def _results() -> Iterator[NDArray[Any]]:
    # Multiples of an irrational number modulo 1: the same on every machine, since each step rounds alike.
    numbers = (np.arange(1.0, 2049.0) * 0.6180339887498949) % 1.0
    wide = 40.0 * numbers - 20.0
    for values in (np.exp(wide), np.expm1(wide), np.tanh(wide), np.sin(wide), np.cos(wide), np.tan(wide)):
        yield values
    for values in (np.log(numbers), np.log1p(numbers), np.sqrt(numbers), np.arcsin(numbers), np.arctan(wide)):
        yield values
    yield np.power(numbers, 0.37)
    yield np.arctan2(wide, numbers)
    yield np.hypot(wide, numbers)
    yield np.array([numbers.sum(), numbers @ wide])
    yield ndtri(numbers)
    yield ndtr(wide)
    libm = (math.exp, math.sin, math.cos, math.tanh, math.atan)
    yield np.array([function(value) for function in libm for value in wide[:256].tolist()])
    yield np.array([math.log(value) for value in numbers[:256].tolist()])
    yield from _of_matrices(numbers)


def _of_matrices(numbers: NDArray[Any]) -> Iterator[NDArray[Any]]:
    for size in (2, 3, 6, 12):
        matrix = numbers[: size * size].reshape(size, size)
        definite = matrix @ matrix.T + np.eye(size)
        yield definite
        yield matrix @ numbers[:size]
        yield np.einsum("ij,kj->ik", matrix, definite)
        yield np.linalg.eigvals(matrix)
        yield np.linalg.eigvalsh(definite)
        yield np.linalg.cholesky(definite)
        yield np.linalg.solve(definite, numbers[:size])
        yield np.linalg.svd(matrix, compute_uv=False)


@functools.cache
def _found() -> tuple[tuple[str, str], ...]:
    found = [("machine", platform.machine()), ("arithmetic", arithmetic_digest())]
    for name in _SOFTWARE:
        try:
            found.append((name, version(name)))
        except PackageNotFoundError:
            continue
    return tuple(found)


def software() -> dict[str, str]:
    """Versions by name of the package, the kind of machine, and the digest of its arithmetic."""
    return dict(_found())
