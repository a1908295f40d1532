# SPDX-FileCopyrightText: 2026 The arm and quad developers
# SPDX-License-Identifier: Apache-2.0
"""The compiled receive path of a socket: datagrams.c, built by the C compiler of the machine.

Without a compiler one warning says so, and frames are read in Python, at several times the cost.
``CANOPEN_CORE_COMPILED=0`` asks for that.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
import ctypes
from functools import lru_cache
import os
from pathlib import Path
import socket
import struct
from threading import Lock
from typing import TypeAlias

from robot_primitives import load_c_library

from .bus import WallClock
from .frame import Frame

SLOTS = 64  # datagrams that are read at once
DATAGRAM_MAX = 384  # [byte] classic frames have up to 164, and a channel's name
WOKEN = 0x10000  # in the number of records: the event of wake() has come
SOURCE = Path(__file__).with_name('datagrams.c')
_RECORD = struct.Struct('@dIHH8s')  # time, identifier or address, size, whether it is raw, data
_PORT = struct.Struct('@H')
_loading = Lock()  # several threads may open the first bus

Layout: TypeAlias = Sequence[bytes]
"""Bytes of a plain frame before and behind its identifier, before and behind its payload."""
Source: TypeAlias = tuple[str, int]
"""IPv4 address and port that a datagram came from."""
Decode: TypeAlias = Callable[[bytes, float, Source], Frame | None]
"""Decodes a datagram, with its time in [s] and its source; None when it is to be dropped."""


class _Reader(ctypes.Structure):
    _fields_ = (
        ('offset', ctypes.c_int64),
        ('last', ctypes.c_double),
        ('lost', ctypes.c_int64),
        ('drops', ctypes.c_uint32),
        ('error', ctypes.c_int32),
        ('own', ctypes.c_uint32),
        ('own_port', ctypes.c_uint16),
        ('sizes', ctypes.c_uint16 * 4),
        ('head', ctypes.c_uint8 * 64),
        ('flags', ctypes.c_uint8 * 96),
        ('key', ctypes.c_uint8 * 16),
        ('tail', ctypes.c_uint8 * 64),
    )


class DatagramReader:
    """Reads the datagrams of one bus; :func:`datagram_reader` is the way in."""

    def __init__(self, library: ctypes.CDLL, layout: Layout, own: Source) -> None:
        self._state = state = _Reader(offset=WallClock().offset)
        if layout:
            (state.own,) = struct.unpack('!I', socket.inet_aton(own[0]))
            state.own_port = own[1]
            state.sizes[:] = [len(part) for part in layout]
            fields = (state.head, state.flags, state.key, state.tail)
            for field, part in zip(fields, layout, strict=True):
                field[: len(part)] = part
        raw = ctypes.create_string_buffer(SLOTS * DATAGRAM_MAX)
        records = ctypes.create_string_buffer(SLOTS * _RECORD.size)
        self._raw, self._records = memoryview(raw).cast('B'), memoryview(records).cast('B')
        self._receive = library.reader_receive
        self._places = ctypes.byref(state), records, raw

    @property
    def lost(self) -> int:
        """Datagrams that the kernel has dropped since the first socket was opened."""
        return int(self._state.lost)

    def reopened(self) -> None:
        """The datagrams come from another socket now, which counts its losses anew."""
        self._state.drops = self._state.error = 0

    def receive(
        self,
        descriptors: tuple[int, int],
        timeout: float,
        expected: int,
        frames: list[Frame],
        decode: Decode,
    ) -> int:
        """Wait for frames at most timeout [s], and append them to the list.

        Args:
            descriptors: Of the socket, and of the event that ends the waiting.
            expected: Frames of process data that it waits for, unless another frame comes.
            decode: Decodes what is no plain frame.

        Returns:
            Number of datagrams, and :data:`WOKEN` beside it when the event has come.

        Raises:
            OSError: The socket failed.
        """
        state, records, raw = self._places
        result: int = self._receive(state, *descriptors, timeout, expected, records, raw)
        if result < 0:
            raise OSError(-result, os.strerror(-result))
        size = (result & ~WOKEN) * _RECORD.size
        append = frames.append
        for at, (stamp, number, length, is_raw, data) in enumerate(
            _RECORD.iter_unpack(self._records[:size])
        ):
            if not is_raw:
                append(Frame(number, data[:length], stamp))
                continue
            begin = at * DATAGRAM_MAX
            address = socket.inet_ntoa(struct.pack('!I', number)), *_PORT.unpack_from(data)
            frame = decode(bytes(self._raw[begin : begin + length]), stamp, address)
            if frame is not None:
                append(frame)
        return result


def datagram_reader(layout: Layout = (), own: Source = ('', 0)) -> DatagramReader | None:
    """Return a reader of a bus that sends from an address; None without a compiler.

    Without a layout its datagrams are those of SocketCAN.
    """
    with _loading:
        loaded = library()
    return None if loaded is None else DatagramReader(loaded, layout, own)


@lru_cache(maxsize=1)
def library() -> ctypes.CDLL | None:
    """Return the compiled receive path, which is built if need be; None where it cannot be."""
    loaded = load_c_library('canopen_core', SOURCE, 'CAN frames are read in Python, slower')
    if loaded is not None:
        pointer, number, real = ctypes.c_void_p, ctypes.c_int, ctypes.c_double
        receive = loaded.reader_receive
        receive.argtypes = [pointer, number, number, real, number, pointer, pointer]
    return loaded
