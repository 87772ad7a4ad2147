"""Logs that are written anew, record by record."""

from __future__ import annotations

import io
from collections.abc import Callable
from typing import Any

from mcap.records import Attachment, Channel, DataEnd, Message, Metadata, Schema
from mcap.stream_reader import StreamReader
from mcap.writer import CompressionType, Writer


def repacked(data: bytes, compression: CompressionType, change: Callable[[Any], Any]) -> bytes:
    """A log written anew."""
    out = io.BytesIO()
    writer = Writer(out, chunk_size=1 << 14, compression=compression)
    writer.start()
    for found in StreamReader(io.BytesIO(data)).records:
        match item := change(found):
            case Schema():
                writer.register_schema(item.name, item.encoding, item.data)
            case Channel():
                writer.register_channel(item.topic, item.message_encoding, item.schema_id)
            case Metadata():
                writer.add_metadata(item.name, item.metadata)
            case Attachment():
                times = (item.create_time, item.log_time)
                writer.add_attachment(*times, item.name, item.media_type, item.data)
            case Message():
                times = (item.log_time, item.data, item.publish_time, item.sequence)
                writer.add_message(item.channel_id, *times)
            case DataEnd():
                break
    writer.finish()
    return out.getvalue()
