# Copyright 2026 satform contributors
# SPDX-License-Identifier: Apache-2.0
"""Names of ROS and addresses as they are text on the command line."""

import ipaddress
import re

from satform_tools.errors import CommandError

_TOKENS = re.compile(r"(/[A-Za-z_][A-Za-z0-9_]*)+")
"""A namespace: tokens that begin with no digit, each after a slash, as rmw validates them."""


def namespace(text: str) -> str:
    """A namespace from the root of all names.

    Args:
        text: with or without the slash in front; empty or `/` for the root.

    Returns:
        For example `/f1`; empty for the root.

    Raises:
        CommandError: it is no namespace of ROS.
    """
    full = "/" + text.strip("/") if text.strip("/") else ""
    if full and (not _TOKENS.fullmatch(full) or "__" in full):
        raise CommandError(
            f"--namespace {text!r} is not a namespace of ROS: letters, digits and single underscores, no "
            "digit first, with / between the parts, e.g. f1 or /fleet/f1"
        )
    return full


def address(text: str) -> str:
    """An IP address of this machine on which a page is served.

    Args:
        text: with or without the brackets of an IPv6 address.

    Raises:
        CommandError: it is no address, or stands for all of this machine.
    """
    try:
        found = ipaddress.ip_address(text.strip("[]"))
    except ValueError:
        raise CommandError(f"--bind {text!r} is not an IP address, e.g. 127.0.0.1 or 192.168.1.20") from None
    if found.is_unspecified:
        raise CommandError(
            f"--bind {text} stands for every address of this machine; name one, so that pages of other "
            "sites cannot pass for this one"
        )
    return str(found)
