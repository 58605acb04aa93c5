# Copyright 2026 satform contributors
# SPDX-License-Identifier: Apache-2.0
"""Pictures of the galleries: PNG files of few colours, with a digest and results as text inside."""

import io
from collections.abc import Collection, Mapping, Sequence
from pathlib import Path

from matplotlib.figure import Figure
from PIL import Image
from PIL.PngImagePlugin import PngInfo

from satform_tools.errors import CommandError

_COLOURS = 256


def prepare(folder: Path, names: Sequence[str], known: Collection[str], what: str) -> None:
    """Make the folder of a gallery, and remove pictures of what is no longer shipped.

    Args:
        folder: of the pictures.
        names: of what is to be drawn.
        known: names of all that is shipped.
        what: has these names, as text in an error.

    Raises:
        CommandError: a name is not known.
    """
    for name in names:
        if name not in known:
            raise CommandError(f"{name!r} is not a shipped {what}; choose from {', '.join(known)}")
    folder.mkdir(parents=True, exist_ok=True)
    for file in folder.glob("*.png"):
        if file.stem not in known:
            file.unlink()


def save(
    drawn: Figure, file: Path, dots_per_inch: int, digest: tuple[str, str], text: tuple[str, str]
) -> None:
    """Write a picture in reduced size, with texts inside.

    Args:
        drawn: the picture.
        file: PNG; replaced if it is there.
        dots_per_inch: of the picture.
        digest: name and value of what shows whether the picture is up to date.
        text: name and value of the results, any characters.

    Raises:
        OSError: the file cannot be written.
    """
    buffer = io.BytesIO()
    drawn.savefig(buffer, format="png", dpi=dots_per_inch)
    with Image.open(buffer) as image:
        save_few_colours(image, file, dict((digest, text)))


def save_few_colours(image: Image.Image, file: Path, texts_inside: Mapping[str, str]) -> None:
    """Write an image as a PNG file of few colours.

    Args:
        image: to be written.
        file: PNG; replaced if it is there.
        texts_inside: by name, any characters.

    Raises:
        OSError: the file cannot be written.
    """
    inside = PngInfo()
    for name, text in texts_inside.items():
        inside.add_itxt(name, text)
    few = image.convert("RGB").quantize(_COLOURS, Image.Quantize.MEDIANCUT, dither=Image.Dither.NONE)
    few.save(file, optimize=True, pnginfo=inside)


def texts(file: Path, names: Collection[str]) -> dict[str, str]:
    """The texts of these names inside a picture; empty when there is no readable picture."""
    try:
        with Image.open(file) as image:
            image.load()
            return {str(key): str(value) for key, value in image.info.items() if key in names}
    except OSError:
        return {}
