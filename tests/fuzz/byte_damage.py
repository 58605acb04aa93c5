# Copyright 2026 satform contributors
# SPDX-License-Identifier: Apache-2.0
"""Changes of bytes that need no knowledge of the format: bits, stretches, numbers that lie."""

import struct
from collections.abc import Sequence
from random import Random

NUMBERS = (0, 1, 2, 3, 7, 8, 127, 128, 255, 256, 2**15, 2**16 - 1, 2**24, 2**31 - 1, 2**31, 2**32 - 1)
NUMBERS += (2**32, 2**40, 2**53, 2**62, 2**63 - 1, 2**63, 2**64 - 1)
"""Lengths, counts and offsets that a file may claim."""

SNIPPETS = (b"\x00", b"\xff\xfe", b"\xef\xbb\xbf", b"\xc3", b"\xed\xa0\x80", b"\r", b"\xf4\x90\x80\x80")
"""Bytes at which readers of text stop."""


def number(draw: Random) -> int:
    """A number that a file may claim, mostly an extreme one."""
    return draw.choice(NUMBERS) if draw.random() < 0.7 else draw.getrandbits(draw.choice((4, 8, 16, 32, 64)))


def packed(draw: Random, width: int, signed: bool = False) -> bytes:
    """A number of some bytes, little-endian."""
    value = number(draw) % 2 ** (8 * width)
    if signed and draw.random() < 0.2:
        value = 2 ** (8 * width) - 1 - value
    return value.to_bytes(width, "little")


def damaged(draw: Random, data: bytes, snippets: Sequence[bytes] = SNIPPETS, changes: int = 6) -> bytes:
    """Bytes after some changes.

    Args:
        draw: source of random numbers.
        data: whole.
        snippets: that are put in.
        changes: largest number of changes.
    """
    text = bytearray(data)
    for _ in range(draw.randint(1, changes)):
        _change(draw, text, snippets)
    return bytes(text)


def _change(draw: Random, text: bytearray, snippets: Sequence[bytes]) -> None:
    place = draw.randrange(len(text) + 1)
    match draw.randrange(8):
        case 0 | 1 if place < len(text):
            text[place] ^= 1 << draw.randrange(8)
        case 2:
            del text[place : place + draw.randint(1, 200)]
        case 3:
            text[place:place] = draw.choice(snippets)
        case 4:
            text[place : place + 8] = draw.randbytes(draw.randrange(20))
        case 5:
            del text[place:]
        case 6:
            text[place:place] = text[place : place + 300]
        case _:
            own = struct.pack("<Q", number(draw) % 2**64)[: draw.choice((1, 2, 4, 8))]
            text[place : place + len(own)] = own
