# SPDX-FileCopyrightText: 2026 The arm and quad developers
# SPDX-License-Identifier: Apache-2.0
"""Base of buses on a datagram socket: waiting, waking, kernel time stamps and loss counts.

The receive path is compiled: datagrams.c, built by the C compiler of the machine. Without a
compiler a warning is logged, and frames are read in Python, at several times the cost.
``CANOPEN_CORE_COMPILED=0`` selects Python.
"""

from __future__ import annotations

from abc import abstractmethod
from collections.abc import Callable, Sequence
import contextlib
import ctypes
from functools import lru_cache
import logging
import math
import os
from pathlib import Path
import select
import socket
import struct
from threading import Lock, RLock
from time import monotonic
from typing import TypeAlias

from robot_primitives import load_c_library

from ..exceptions import BusError
from .bus import Bus, WallClock
from .frame import Frame, STANDARD_ID_MAX

SLOTS = 64  # datagrams that are read at once
DATAGRAM_MAX = 384  # [byte] classic frames have up to 164, and a channel's name
WOKEN = 0x10000  # in the number of records: the event of wake() has come
SOURCE = Path(__file__).with_name('datagrams.c')
_RECORD = struct.Struct('@dIHH8s')  # time, identifier or address, size, whether it is raw, data
_PORT = struct.Struct('@H')
_loading = Lock()  # several threads may open the first bus

Layout: TypeAlias = Sequence[bytes]
"""Fixed bytes of a plain frame before and after its identifier, before and after its payload."""
Source: TypeAlias = tuple[str, int]
"""Source IPv4 address and port of a datagram."""
Decode: TypeAlias = Callable[[bytes, float, Source], Frame | None]
"""Decodes a datagram, with its time in [s] and its source; None to drop it."""


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
    """Reads the datagrams of one bus; create it by :func:`datagram_reader`."""

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
        """Expect the kernel's drop count from 0 again, because another socket was opened."""
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
            descriptors: File descriptors of the socket, and of the event that ends the wait.
            expected: Number of process data frames to wait for, unless another frame arrives.
            decode: Decodes datagrams that are not plain frames.

        Returns:
            Number of datagrams, combined with :data:`WOKEN` if the event was set.

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
    """Return a reader for a bus that sends from an address; None without a compiler.

    Without a layout, datagrams have the format of SocketCAN.
    """
    with _loading:
        loaded = library()
    return None if loaded is None else DatagramReader(loaded, layout, own)


@lru_cache(maxsize=1)
def library() -> ctypes.CDLL | None:
    """Return the compiled receive path, building it if necessary; None if that is not possible."""
    loaded = load_c_library('canopen_core', SOURCE, 'CAN frames are read in Python, slower')
    if loaded is not None:
        pointer, number, real = ctypes.c_void_p, ctypes.c_int, ctypes.c_double
        receive = loaded.reader_receive
        receive.argtypes = [pointer, number, number, real, number, pointer, pointer]
    return loaded


# of asm-generic/socket.h; Python's socket module does not name them
SO_RCVBUFFORCE = 33
SO_TIMESTAMPNS = 35
SO_RXQ_OVFL = 40

RECEIVE_BUFFER = 4 << 20  # [byte] thousands of frames; the kernel's default holds some hundred
BATCH_MAX = 1000  # frames; a flooded bus must not keep the caller inside receive
_FD_SETSIZE = 1024  # select() takes no descriptors beyond
_TIMESPEC = struct.Struct('@ll')
_UINT32 = struct.Struct('=I')
ANCILLARY_SIZE = socket.CMSG_SPACE(_TIMESPEC.size) + socket.CMSG_SPACE(_UINT32.size)  # [byte]
_READ_AHEAD = 1e-3  # [s] frames may arrive while a batch is read
_log = logging.getLogger(__name__)


def prepare_receiver(sock: socket.socket) -> None:
    """Enlarge the receive buffer; enable time stamps and the count of dropped frames."""
    try:
        sock.setsockopt(socket.SOL_SOCKET, SO_RCVBUFFORCE, RECEIVE_BUFFER)
    except PermissionError:
        sock.setsockopt(socket.SOL_SOCKET, socket.SO_RCVBUF, RECEIVE_BUFFER)
    sock.setsockopt(socket.SOL_SOCKET, SO_TIMESTAMPNS, 1)
    sock.setsockopt(socket.SOL_SOCKET, SO_RXQ_OVFL, 1)
    sock.setblocking(False)


def loss_text(name: str, granted: int) -> str:
    """Describe a loss of frames, and the remedy for a receive buffer of this size in [byte]."""
    text = f'{name}: frames were lost, because they came faster than this process reads them'
    if granted >= RECEIVE_BUFFER:
        return text
    return f'{text}; `sysctl -w net.core.rmem_max={RECEIVE_BUFFER}` allows a larger buffer'


class TimestampReader:
    """Converts ancillary data of received datagrams to steady time and a count of losses.

    The kernel stamps with the wall clock. Results never go back, even if that clock is set.
    """

    def __init__(self) -> None:
        self.lost = 0  # datagrams that the kernel has dropped since the socket was opened
        self._drops = 0
        self._last = 0.0
        self._limit = 0.0
        self._clock = WallClock()

    def reopened(self) -> None:
        """Expect the kernel's drop count from 0 again, because another socket was opened."""
        self._drops = 0

    def begin_batch(self) -> None:
        """Compare the wall clock with the steady clock."""
        self._limit = self._clock.update() * 1e-9 + _READ_AHEAD

    def read(self, ancillary: list[tuple[int, int, bytes]]) -> float:
        """Return the time of arrival on the steady clock in [s], and count losses."""
        stamp = 0.0
        for _, kind, content in ancillary:
            if kind == SO_TIMESTAMPNS:
                seconds, nanoseconds = _TIMESPEC.unpack(content)
                stamp = (seconds * 1_000_000_000 + nanoseconds - self._clock.offset) * 1e-9
            elif kind == SO_RXQ_OVFL:
                (drops,) = _UINT32.unpack(content)
                self.lost += (drops - self._drops) & 0xFFFF_FFFF
                self._drops = drops
        if stamp > self._limit or stamp == 0.0:
            stamp = monotonic() if stamp == 0.0 else min(stamp, monotonic())
        self._last = max(stamp, self._last)
        return self._last


class SocketBus(Bus):
    """A bus that reads datagrams from a socket; subclasses define their content."""

    def __init__(
        self,
        name: str,
        receiver: socket.socket,
        sender: socket.socket,
        reader: DatagramReader | None,
    ) -> None:
        """Use the compiled reader, or Python without one."""
        super().__init__(name)
        self._receiver, self._sender = receiver, sender
        self._send_lock = RLock()
        self._reader = reader
        self._sent: dict[int, tuple[Frame, bytes]] = {}  # last datagrams, by 11-bit identifier
        self._stamps = TimestampReader()  # used without a compiled reader
        self._wake_fd = os.eventfd(0, os.EFD_NONBLOCK | os.EFD_CLOEXEC)
        # of the three below: a closed descriptor is another's by the next moment. A signal handler
        # may wake the bus.
        self._use_lock = RLock()
        self._receiving = 0  # threads that are inside receive
        self._closed = False

    @abstractmethod
    def _encode(self, frame: Frame) -> bytes:
        """Return the datagram of a frame."""

    @abstractmethod
    def _decode(self, datagram: bytes, stamp: float, source: Source) -> Frame | None:
        """Return the frame of a datagram; None if it must not be delivered."""

    @abstractmethod
    def _explain(self, error: OSError) -> BusError:
        """Explain what a failed system call means for the user, and the remedy."""

    def fileno(self) -> int:
        """Return the descriptor that is readable when there are frames."""
        return self._receiver.fileno()

    def send(self, frame: Frame) -> None:
        """Hand the frame to the kernel.

        A full queue raises an error instead of waiting: a cyclic frame is outdated by its
        successor, and a client repeats its request after a time-out.
        """
        sent, datagram = self._sent.get(frame.can_id, (None, b''))
        if sent is not frame:  # an axis at rest gets the same one in each cycle
            datagram = self._encode(frame)
            if frame.can_id <= STANDARD_ID_MAX and type(frame.data) is bytes:
                self._sent[frame.can_id] = frame, datagram
        with self._send_lock:
            if self._closed:
                raise BusError(f'{self.name} is closed')
            try:
                self._sender.send(datagram)
            except OSError as error:
                self.counters.send_errors += 1
                raise self._explain(error) from error
            self.counters.sent += 1

    def receive(self, timeout: float) -> list[Frame]:
        """Wait for frames; see :meth:`Bus.receive`."""
        with self._use_lock:
            if self._closed:
                raise BusError(f'{self.name} is closed')
            self._receiving += 1
        try:
            frames = self._receive(timeout)
        except BusError:
            raise
        except OSError as error:
            raise self._explain(error) from error
        finally:
            with self._use_lock:
                self._receiving -= 1
                if self._closed:
                    self._release()
        self.counters.received += len(frames)
        return frames

    def _receive(self, timeout: float) -> list[Frame]:
        if self._reader is not None:
            frames = self._receive_compiled(self._reader, timeout)
        else:
            if timeout > 0.0:
                self._wait(timeout)
            frames = self._drain()
        self._note_losses((self._reader or self._stamps).lost)
        return frames

    def _receive_compiled(self, reader: DatagramReader, timeout: float) -> list[Frame]:
        frames: list[Frame] = []
        taken = 0
        while True:
            descriptors = self._receiver.fileno(), self._wake_fd
            count = reader.receive(descriptors, timeout, self.batch, frames, self._decode)
            taken += count & ~WOKEN  # also of others than frames, so that a flood of them ends
            if self._closed:
                raise BusError(f'{self.name} was closed')
            if taken >= BATCH_MAX or not (count & WOKEN or count == SLOTS):
                return frames
            timeout = 0.0

    def _wait(self, timeout: float) -> None:
        descriptors = self._receiver.fileno(), self._wake_fd
        if max(descriptors) < _FD_SETSIZE:
            # select waits by the microsecond where poll rounds up to a millisecond
            limit = None if math.isinf(timeout) else timeout
            readable = select.select(descriptors, (), (), limit)[0]
        else:
            readable = _poll(descriptors, timeout)
        if self._wake_fd in readable:
            with contextlib.suppress(BlockingIOError):
                os.eventfd_read(self._wake_fd)
        if self._closed:
            raise BusError(f'{self.name} was closed')

    def _drain(self) -> list[Frame]:
        frames: list[Frame] = []
        self._stamps.begin_batch()
        receive = self._receiver.recvmsg
        try:
            for _ in range(BATCH_MAX):
                datagram, ancillary, _, source = receive(DATAGRAM_MAX, ANCILLARY_SIZE)
                frame = self._decode(datagram, self._stamps.read(ancillary), source)
                if frame is not None:
                    frames.append(frame)
        except BlockingIOError:
            pass
        return frames

    def _note_losses(self, lost: int) -> None:
        if lost == self.counters.lost:
            return
        if not self.counters.lost:
            # the kernel doubles the size for its own bookkeeping, and returns the double
            granted = self._receiver.getsockopt(socket.SOL_SOCKET, socket.SO_RCVBUF) // 2
            _log.warning('%s', loss_text(self.name, granted))
        self.counters.lost = lost

    def wake(self) -> None:
        """Wake a waiting :meth:`receive`."""
        with self._use_lock:
            if not self._closed:
                os.eventfd_write(self._wake_fd, 1)

    def close(self) -> None:
        """Close the sockets; a thread waiting in :meth:`receive` stops waiting and closes them."""
        with self._use_lock:
            if self._closed:
                return
            self.wake()
            self._closed = True
            self._release()

    def _release(self) -> None:
        """Close the descriptors once no thread uses them in a call."""
        if self._receiving:
            return
        with self._send_lock:
            self._receiver.close()
            self._sender.close()
            os.close(self._wake_fd)


def _poll(descriptors: tuple[int, ...], timeout: float) -> list[int]:
    poller = select.poll()
    for descriptor in descriptors:
        poller.register(descriptor, select.POLLIN)
    limit = None if math.isinf(timeout) else math.ceil(timeout * 1e3)
    return [descriptor for descriptor, _ in poller.poll(limit)]
