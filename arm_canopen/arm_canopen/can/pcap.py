# SPDX-FileCopyrightText: 2026 The arm and quad developers
# SPDX-License-Identifier: Apache-2.0
"""Captures of a bus that Wireshark opens and saves: libpcap's files with frames of SocketCAN.

Sources: pcap-savefile(5) of libpcap, and LINKTYPE_CAN_SOCKETCAN in tcpdump.org's list of link
types.
The classes have the form of python-can's for other formats.
"""

from __future__ import annotations

from collections.abc import Iterator
from pathlib import Path
import struct

import can

MICROSECONDS, NANOSECONDS = 0xA1B2C3D4, 0xA1B23C4D
"""First number of a file, by the unit of its times."""
UNITS = {MICROSECONDS: 1e-6, NANOSECONDS: 1e-9}
"""Unit of the fractions of a second in [s]."""
VERSION = (2, 4)
SNAP_LENGTH = 65535
"""Longest packet in [bytes]."""
CAN_SOCKETCAN = 227
"""Link type: the identifier with flags in network order, length, FD flags, two bytes, data."""
EXTENDED, REMOTE, ERROR = 0x8000_0000, 0x4000_0000, 0x2000_0000
"""Flags of the identifier."""
IDENTIFIER = 0x1FFF_FFFF
FD_FRAME = 0x04
"""FD flag of a CAN FD frame."""
MAX_DATA = 8
"""Most data of a classic frame in [bytes]."""

_FILE = 'IHHiIII'
_PACKET = 'IIII'
_FRAME = struct.Struct('>IBBxx')


class PcapWriter:
    """Writes a capture.

    Attributes:
        file: What is written.
    """

    def __init__(self, path: Path) -> None:
        """Open a new file."""
        self.file = path.open('wb')
        self.file.write(
            struct.pack(f'<{_FILE}', MICROSECONDS, *VERSION, 0, 0, SNAP_LENGTH, CAN_SOCKETCAN)
        )

    def on_message_received(self, message: can.Message) -> None:
        """Write a classic CAN frame."""
        flags = (
            EXTENDED * message.is_extended_id
            | REMOTE * message.is_remote_frame
            | ERROR * message.is_error_frame
        )
        data = bytes(message.data)
        packet = _FRAME.pack(message.arbitration_id | flags, message.dlc, 0) + data
        seconds, fraction = divmod(round(message.timestamp * 1e6), 1_000_000)
        header = struct.pack(f'<{_PACKET}', seconds, fraction, len(packet), len(packet))
        self.file.write(header + packet)

    def stop(self) -> None:
        """Close the file."""
        self.file.close()


class PcapReader:
    """Reads a capture of this program, of Wireshark or of tcpdump."""

    def __init__(self, path: Path, *, relative_timestamp: bool = False) -> None:
        """Open a file, whose times are those of the wall clock.

        Args:
            path: The file.
            relative_timestamp: Whether times begin at zero; as python-can's readers have it.

        Raises:
            ValueError: They are wanted to.
        """
        if relative_timestamp:
            raise ValueError('captures have the times of the wall clock')
        self._path = path

    def __iter__(self) -> Iterator[can.Message]:
        """Yield the frames.

        Raises:
            ValueError: The file is damaged, or is no capture of CAN frames.
        """
        content = self._path.read_bytes()
        order, unit = _layout(content)
        at, header = struct.calcsize(f'={_FILE}'), struct.Struct(order + _PACKET)
        while at < len(content):
            if at + header.size > len(content):
                raise ValueError('the last packet is cut off')
            seconds, fraction, kept, length = header.unpack_from(content, at)
            at += header.size
            if kept != length or at + kept > len(content):
                raise ValueError('a packet is cut off')
            yield _message(content[at : at + kept], seconds + unit * fraction)
            at += kept


def _layout(content: bytes) -> tuple[str, float]:
    """Return the byte order of a file, and the unit of its fractions of a second in [s]."""
    for order in '<>':
        with_order = struct.Struct(order + _FILE)
        if len(content) < with_order.size:
            continue
        magic, *_, link = with_order.unpack_from(content)
        if magic not in UNITS:
            continue
        if link & 0xFFFF != CAN_SOCKETCAN:
            raise ValueError(
                f'its link type is {link & 0xFFFF}, frames of CAN have {CAN_SOCKETCAN}; capture'
                ' on the CAN interface itself'
            )
        return order, UNITS[magic]
    raise ValueError('no capture of libpcap; in Wireshark, save as pcap, not as pcapng')


def _message(packet: bytes, timestamp: float) -> can.Message:
    if len(packet) < _FRAME.size:
        raise ValueError(f'a packet has {len(packet)} bytes, a frame {_FRAME.size} or more')
    identifier, length, fd_flags = _FRAME.unpack_from(packet)
    data = packet[_FRAME.size : _FRAME.size + length]
    is_remote = bool(identifier & REMOTE)
    if len(data) < length and not is_remote:
        raise ValueError(f'a frame has {len(data)} of {length} bytes')
    is_error = bool(identifier & ERROR)
    return can.Message(
        timestamp=timestamp,
        arbitration_id=identifier & IDENTIFIER,
        is_extended_id=bool(identifier & EXTENDED) and not is_error,
        is_remote_frame=is_remote,
        is_error_frame=is_error,
        is_fd=bool(fd_flags & FD_FRAME) or length > MAX_DATA,
        data=b'' if is_remote else data,
        dlc=length if is_remote else len(data),
    )
