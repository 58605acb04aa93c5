# Copyright 2026 satform contributors
# SPDX-License-Identifier: Apache-2.0
"""Which machine runs which part of a formation that flies on several."""

import difflib
import ipaddress
from collections import Counter
from collections.abc import Collection, Sequence
from typing import Annotated

from pydantic import Field, field_validator

from satform.common.spec import Complaint, Spec

_SHARED_PARTS = ("plant", "recorder")


class HostSpec(Spec):
    """One machine of a flight on several, and what it runs."""

    name: Annotated[str, Field(pattern=r"^[a-z][a-z0-9_-]{0,39}$")]
    """Name by which the machine is told which part is its own: `run SCENARIO --host NAME`."""
    address: Annotated[str, Field(pattern=r"^[A-Za-z0-9]([A-Za-z0-9.-]{0,251}[A-Za-z0-9])?$")]
    """IPv4 address, or name in the DNS, at which all the others reach it."""
    runs: Annotated[tuple[str, ...], Field(min_length=1)]
    """What it runs: `plant`, `recorder`, and satellites by name. An external satellite need not be
    named; where it is, its node is started there by somebody else."""

    @field_validator("address")
    @classmethod
    def _possible(cls, address: str) -> str:
        if address.replace(".", "").isdigit():
            try:
                ipaddress.IPv4Address(address)
            except ValueError:
                raise ValueError(f"{address} is not an IPv4 address such as 192.168.1.10") from None
        return address


def host_complaints(
    hosts: Sequence[HostSpec], satellites: Sequence[str], external: Collection[str] = ()
) -> list[Complaint]:
    """What is wrong with the distribution of a formation's parts.

    Args:
        hosts: of the scenario; empty when it has none.
        satellites: names of all satellites.
        external: names of those whose nodes somebody else starts.

    Returns:
        Path and sentence of each fault: every part is run by exactly one host, an external satellite by one
        at most, and no two hosts share a name or an address.
    """
    if not hosts:
        return []
    parts = (*_SHARED_PARTS, *satellites)
    return [
        *_duplicates(hosts, "name"),
        *_duplicates(hosts, "address"),
        *_loopbacks(hosts),
        *_unknown_parts(hosts, parts),
        *_miscounted_parts(hosts, parts, external),
    ]


def _duplicates(hosts: Sequence[HostSpec], field: str) -> list[Complaint]:
    complaints: list[Complaint] = []
    seen: dict[str, str] = {}
    for index, host in enumerate(hosts):
        value = getattr(host, field)
        if value in seen:
            sentence = f"another host has the {field} {value} too; every host has to have its own"
            complaints.append((("hosts", index, field), sentence))
        seen[value] = host.name
    return complaints


def _loopbacks(hosts: Sequence[HostSpec]) -> list[Complaint]:
    """An address that every machine takes for its own leads to nobody else."""
    if len(hosts) == 1:
        return []
    return [
        (
            ("hosts", index, "address"),
            f"{host.address} is each machine's word for itself; the others need the address at which they "
            f"reach {host.name}",
        )
        for index, host in enumerate(hosts)
        if host.address.startswith("127.") or host.address in {"localhost", "0.0.0.0"}  # noqa: S104 - refused
    ]


def _unknown_parts(hosts: Sequence[HostSpec], parts: Sequence[str]) -> list[Complaint]:
    complaints: list[Complaint] = []
    for index, host in enumerate(hosts):
        for row, part in enumerate(host.runs):
            if part in parts:
                continue
            close = difflib.get_close_matches(part, parts, n=1)
            meant = f"did you mean {close[0]}?" if close else f"there are {', '.join(parts)}"
            complaints.append((("hosts", index, "runs", row), f"there is no {part} to be run; {meant}"))
    return complaints


def _miscounted_parts(
    hosts: Sequence[HostSpec], parts: Sequence[str], external: Collection[str]
) -> list[Complaint]:
    count = Counter(part for host in hosts for part in host.runs)
    complaints: list[Complaint] = []
    homeless = [part for part in parts if not count[part] and part not in external]
    if homeless:
        sentence = f"no host runs {', '.join(homeless)}; every part is run by exactly one host"
        complaints.append((("hosts",), sentence))
    for part in parts:
        if count[part] > 1:
            where = ", ".join(dict.fromkeys(host.name for host in hosts if part in host.runs))
            sentence = (
                f"{part} is run {count[part]} times (by {where}); every part is run by exactly one host"
            )
            complaints.append((("hosts",), sentence))
    return complaints
