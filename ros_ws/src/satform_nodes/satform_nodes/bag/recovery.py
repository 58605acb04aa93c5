# Copyright 2026 satform contributors
# SPDX-License-Identifier: Apache-2.0
"""A whole bag from one whose recorder was killed: what can be read of it, written anew with its description.

The damaged file is read in order up to its end, or to where it is damaged; it is never changed. What is read
is written into another folder, with chunks, index and summary as of a recorder that has ended, and with
rosbag2's `metadata.yaml` beside it.
"""

import shutil
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

import yaml
from mcap.exceptions import McapError
from mcap.records import Attachment, Channel, Message, Metadata, Schema
from rosbags.typesys import Stores, get_types_from_msg, get_typestore

from satform.bag.errors import BagError
from satform.bag.format import ROLE
from satform.bag.reader import READ_FAILURES, find_file
from satform.bag.records import records
from satform_nodes.bag import metadata as bag_metadata
from satform_nodes.bag.writer import BagFile
from satform_nodes.transport.message_definitions import SEPARATOR, MessageType


@dataclass(frozen=True)
class Recovered:
    """What became of a damaged bag.

    Attributes:
        source: the damaged file, which is as it was.
        folder: of the new bag.
        messages: number of messages in it.
        topics: number of topics in it.
        damage: why the file could not be read further; empty where it was read to its end.
    """

    source: Path
    folder: Path
    messages: int
    topics: int
    damage: str


@dataclass
class _Copy:
    """A bag that is being written from the records of another.

    Attributes:
        bag: the new one.
        schemas: by their numbers in the source.
        channels: numbers in the new bag by those in the source.
    """

    bag: BagFile
    schemas: dict[int, Schema] = field(default_factory=dict)
    channels: dict[int, int] = field(default_factory=dict)

    def take(self, record: Any) -> None:
        """Write a record of the source; what describes the source as a whole is made anew.

        Raises:
            McapError: the record needs another one that was not in the file before it.
            OSError: it cannot be written.
        """
        if isinstance(record, Message):
            channel = self.channels.get(record.channel_id)
            if channel is None:
                raise McapError(f"a message is on channel {record.channel_id}, which is not described")
            self.bag.write(channel, record.log_time, record.data, record.sequence)
        elif isinstance(record, Schema):
            self.schemas[record.id] = record
        elif isinstance(record, Channel):
            if record.id not in self.channels:
                self.channels[record.id] = self._add(record)
        elif isinstance(record, Attachment):
            self.bag.add_attachment(record.name, record.media_type, record.data)
        elif isinstance(record, Metadata) and record.name != bag_metadata.RECORD:
            self.bag.add_metadata(record.name, record.metadata)

    def _add(self, channel: Channel) -> int:
        schema, facts = self.schemas.get(channel.schema_id), channel.metadata
        if schema is None:
            raise McapError(f"the type of the messages on {channel.topic} is not described")
        text = schema.data.decode(errors="replace")
        digest = facts.get(bag_metadata.HASH_KEY) or type_hash_of(schema.name, text)
        profiles = profiles_in(facts.get(bag_metadata.QOS_KEY, ""))
        message_type = MessageType(schema.name, text, digest)
        return self.bag.add_topic(channel.topic, message_type, profiles, facts.get(ROLE, ""))


def is_whole(path: Path) -> bool:
    """Whether a bag can be read to its end, and rosbag2's description of it fits.

    Args:
        path: folder of a bag, or its MCAP file.

    Raises:
        BagError: there is no such bag.
        OSError: it cannot be read.
    """
    file = find_file(path)
    try:
        messages = sum(isinstance(record, Message) for record in records(file))
    except OSError:
        raise
    except READ_FAILURES:
        return False
    return bag_metadata.fits(file.parent, messages)


def recover(path: Path, folder: Path) -> Recovered:
    """Write a whole bag from what can be read of another.

    Args:
        path: folder of the damaged bag, or its MCAP file; nothing in it is changed.
        folder: of the new bag, made here.

    Returns:
        What became of it.

    Raises:
        BagError: there is no such bag, or nothing in it that can be read.
        FileExistsError: there is something at the new folder's place.
        OSError: the file cannot be read, or the new bag not written.
    """
    file = find_file(path)
    folder.mkdir(parents=True)
    try:
        copy = _Copy(BagFile(folder))
        damage = _copied(file, copy)
        if not copy.bag.messages:
            raise BagError(f"{file}: holds no message that can be read: {damage or 'it is empty'}")
        copy.bag.close()
    except BaseException:
        # Made here; half a bag would be taken for a whole one.
        shutil.rmtree(folder)
        raise
    return Recovered(file, folder, copy.bag.messages, len(copy.channels), damage)


def _copied(file: Path, copy: _Copy) -> str:
    """Copy up to the file's end or to its damage; what that is, empty for none."""
    source = records(file)
    while True:
        try:
            record = next(source, None)
        except OSError:
            raise
        except READ_FAILURES as error:
            return str(error) or "it ends within a record"
        if record is None:
            return ""
        try:
            copy.take(record)
        except McapError as error:
            return str(error)


def profiles_in(text: str) -> list[bag_metadata.Profile]:
    """Qualities of service from the text that rosbag2 keeps of them with a topic.

    Args:
        text: from a bag, which may be any.

    Returns:
        One for each publisher; none where the text is of another form.
    """
    # Aliases, which rosbag2 does not write, can stand for more than fits into memory.
    if "&" in text:
        return []
    try:
        found = yaml.safe_load(text)
    except (yaml.YAMLError, ValueError, RecursionError):
        return []
    fits = isinstance(found, list) and all(isinstance(entry, dict) for entry in found)
    return found if fits and _is_plain(found) else []


def _is_plain(value: Any) -> bool:
    """Whether a value is made of texts, numbers, flags, lists and mappings by text alone."""
    if isinstance(value, dict):
        return all(isinstance(key, str) and _is_plain(entry) for key, entry in value.items())
    if isinstance(value, list):
        return all(map(_is_plain, value))
    return isinstance(value, str | int | float)


def type_hash_of(name: str, definition: str) -> str:
    """RIHS01 hash of a type from its definition, for bags that were recorded without.

    Args:
        name: of the type.
        definition: with all that it contains, in ros2msg form.

    Returns:
        The hash; empty where the text is no definition.
    """
    own, *others = definition.split(f"{SEPARATOR}\n")
    texts = {name: own}
    for text in others:
        head, _, body = text.partition("\n")
        texts["/msg/".join(head.removeprefix("MSG: ").split("/"))] = body
    store = get_typestore(Stores.EMPTY)
    try:
        for own_name, text in texts.items():
            store.register(get_types_from_msg(text, own_name))
        return str(store.hash_rihs01(name))
    except Exception:  # the parser is given the bag's text, which may be any
        return ""
