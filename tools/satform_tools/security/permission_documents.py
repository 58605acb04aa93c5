# Copyright 2026 satform contributors
# SPDX-License-Identifier: Apache-2.0
"""The XML documents of a secured formation: SROS 2 policies, DDS permissions and DDS governance.

What each node may publish, subscribe to and call is computed in `access`; `keystore` signs and stores the
documents.

Source: OMG DDS Security 1.1, section 9.4 (governance and permissions documents); ROS 2 design, "ROS 2 Access
Control Policies" (policies) and "ROS 2 DDS-Security integration" (prefixes of topics and services).
"""

from collections.abc import Iterable, Sequence
from datetime import datetime
from xml.etree.ElementTree import Element, SubElement, indent, tostring

from satform_bringup.deployment.domain_lock import HIGHEST_SECURED
from satform_tools.security.access import Access

_SCHEMAS = "http://www.omg.org/spec/DDS-SECURITY/20170901/"
_SCHEMA_ATTRIBUTE = "xsi:noNamespaceSchemaLocation"
_POLICY_VERSION = "0.2.0"

# The topic on which ROS 2 nodes exchange their graph.
_DISCOVERY = "ros_discovery_info"

ANY_DOMAIN = (0, HIGHEST_SECURED)
"""First and last of the DDS domains that every DDS takes in these documents."""


def policies(accesses: Sequence[Access]) -> bytes:
    """The policies of a formation, as `ros2 security create_permission` reads them.

    Args:
        accesses: what each node may do.

    Returns:
        The document, in UTF-8.
    """
    root = Element("policy", version=_POLICY_VERSION)
    enclaves = SubElement(root, "enclaves")
    for access in accesses:
        profiles = SubElement(SubElement(enclaves, "enclave", path=access.enclave), "profiles")
        profile = SubElement(profiles, "profile", ns="/", node=access.node)
        for kind, qualifier, names in (
            ("topic", "publish", access.publishes),
            ("topic", "subscribe", access.subscribes),
            ("service", "reply", access.replies),
            ("service", "request", access.requests),
        ):
            if names:
                listed = SubElement(profile, f"{kind}s", {qualifier: "ALLOW"})
                _list(listed, kind, names)
    return _text(root)


def permissions(access: Access, begin: datetime, end: datetime, domains: tuple[int, int]) -> bytes:
    """The permissions of one node, before they are signed.

    Args:
        access: what it may do.
        begin: from when on, in UTC.
        end: until when, in UTC.
        domains: first and last DDS domain.

    Returns:
        The document, in UTF-8.
    """
    root = _dds("omg_shared_ca_permissions.xsd")
    grant = SubElement(SubElement(root, "permissions"), "grant", name=access.enclave)
    SubElement(grant, "subject_name").text = f"CN={access.enclave}"
    validity = SubElement(grant, "validity")
    SubElement(validity, "not_before").text = _moment(begin)
    SubElement(validity, "not_after").text = _moment(end)
    rule = SubElement(grant, "allow_rule")
    _add_domains(rule, domains)
    requests = [f"rq{name}Request" for name in access.requests]
    replies = [f"rr{name}Reply" for name in access.requests]
    published = [f"rt{name}" for name in access.publishes] + [f"rr{name}Reply" for name in access.replies]
    subscribed = [f"rt{name}" for name in access.subscribes] + [f"rq{name}Request" for name in access.replies]
    for kind, names in (("publish", published + requests), ("subscribe", subscribed + replies)):
        _list(SubElement(SubElement(rule, kind), "topics"), "topic", sorted([*names, _DISCOVERY]))
    SubElement(grant, "default").text = "DENY"
    return _text(root)


def governance(domains: tuple[int, int]) -> bytes:
    """The governance of the domain, before it is signed: no unauthenticated participant, all data encrypted.

    Args:
        domains: first and last DDS domain.

    Returns:
        The document, in UTF-8.
    """
    root = _dds("omg_shared_ca_governance.xsd")
    rule = SubElement(SubElement(root, "domain_access_rules"), "domain_rule")
    _add_domains(rule, domains)
    for name, value in (
        ("allow_unauthenticated_participants", "false"),
        ("enable_join_access_control", "true"),
        ("discovery_protection_kind", "ENCRYPT"),
        ("liveliness_protection_kind", "ENCRYPT"),
        ("rtps_protection_kind", "SIGN"),
    ):
        SubElement(rule, name).text = value
    topic = SubElement(SubElement(rule, "topic_access_rules"), "topic_rule")
    for name, value in (
        ("topic_expression", "*"),
        ("enable_discovery_protection", "true"),
        ("enable_liveliness_protection", "true"),
        ("enable_read_access_control", "true"),
        ("enable_write_access_control", "true"),
        ("metadata_protection_kind", "ENCRYPT"),
        ("data_protection_kind", "ENCRYPT"),
    ):
        SubElement(topic, name).text = value
    return _text(root)


def _dds(schema: str) -> Element:
    attributes = {
        "xmlns:xsi": "http://www.w3.org/2001/XMLSchema-instance",
        _SCHEMA_ATTRIBUTE: f"{_SCHEMAS}{schema}",
    }
    return Element("dds", attributes)


def _add_domains(rule: Element, domains: tuple[int, int]) -> None:
    listed = SubElement(rule, "domains")
    first, last = domains
    if first == last:
        SubElement(listed, "id").text = str(first)
        return
    span = SubElement(listed, "id_range")
    SubElement(span, "min").text = str(first)
    SubElement(span, "max").text = str(last)


def _list(parent: Element, kind: str, names: Iterable[str]) -> None:
    for name in names:
        SubElement(parent, kind).text = name


def _moment(time: datetime) -> str:
    return time.replace(tzinfo=None, microsecond=0).isoformat()


def _text(root: Element) -> bytes:
    indent(root)
    # Fast DDS takes what follows the declaration; SROS 2 writes none before its signed documents either.
    return bytes(tostring(root, encoding="unicode") + "\n", "utf-8")
