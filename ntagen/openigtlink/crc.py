"""The checksum of OpenIGTLink: CRC-64 with the polynomial of ECMA-182.

Start value 0, most significant bit first, no final inversion, over the whole body of a message
(openigtlink.org/protocols/v2_header.html).
"""

from __future__ import annotations

from typing import Final

POLYNOMIAL: Final = 0x42F0E1EBA9EA3693

_MASK: Final = 2**64 - 1


def _entry(index: int) -> int:
    """The checksum of one byte."""
    value = index << 56
    for _ in range(8):
        value = (value << 1) ^ (POLYNOMIAL if value >> 63 else 0)
        value &= _MASK
    return value


_TABLE: Final = tuple(_entry(index) for index in range(256))


def crc64(data: bytes, start: int = 0) -> int:
    """The checksum of bytes.

    Args:
        data: The bytes.
        start: The checksum of the bytes before them.
    """
    value = start
    for byte in data:
        value = ((value << 8) & _MASK) ^ _TABLE[(value >> 56) ^ byte]
    return value
