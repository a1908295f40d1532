# SPDX-FileCopyrightText: 2026 The arm and quad developers
# SPDX-License-Identifier: Apache-2.0
"""CAN adapters with a python-can driver."""

from __future__ import annotations

from concurrent.futures import Future, InvalidStateError
import contextlib
import errno
from functools import partial
import logging
from threading import Event, Lock, Thread
from time import monotonic
from typing import Any

import can

from ..exceptions import BusError
from .bus import Bus, WallClock
from .frame import checked, Frame, PAYLOAD_MAX

_POLL = 0.02  # [s] longest time until wake() is noticed; python-can has no way to end a recv
_BATCH_MAX = 1000  # frames; a flooded bus must not keep the caller inside receive
_DAMAGED_MAX = 100  # messages in a row, after which the adapter counts as gone
_WALL_CLOCK_SPAN = 1.0  # [s] stamps further from now count from something else than 1970
# [s] for which a serial adapter may take no more bytes; other drivers mean something else by it
_SEND_TIMEOUTS = {'slcan': 0.02, 'robotell': 0.02}
_UNPLUGGED = frozenset({errno.ENODEV, errno.ENXIO, errno.EIO})
_log = logging.getLogger(__name__)


class AdapterBus(Bus):
    """A bus behind a python-can interface, e.g. PCAN, Kvaser or slcan.

    Options beyond channel and bit rate come from python-can's own configuration files.
    """

    def __init__(self, name: str, interface: str, channel: str, bitrate: int | None) -> None:
        """Open a channel of a python-can interface; bitrate None keeps the adapter's bit rate."""
        super().__init__(name)
        self._open = partial(_open_driver, name, interface, channel, bitrate)
        self._bus = self._open()
        self._send_timeout = _SEND_TIMEOUTS.get(interface)
        self._woken = Event()
        self._send_lock = Lock()
        self._closed = self._gone = False
        self._reopening: Future[can.BusABC] | None = None
        self._clock = WallClock()
        self._last = 0.0
        self._damaged = 0

    def send(self, frame: Frame) -> None:
        """Hand the frame to the adapter."""
        message = to_message(checked(frame))
        if self._closed:
            raise BusError(f'{self.name} is closed')
        if self._gone:
            self.counters.send_errors += 1
            raise BusError(f'{self.name} went away')
        try:
            with self._send_lock:
                self._bus.send(message, self._send_timeout)
                self.counters.sent += 1
        except (can.CanError, OSError) as error:
            self.counters.send_errors += 1
            self._gone = self._gone or _is_unplugged(error)  # some drivers notice it here only
            raise BusError(f'{self.name} refuses a frame: {error}') from error

    def receive(self, timeout: float) -> list[Frame]:
        """Wait for frames; reopen an unplugged adapter when it is back."""
        if self._closed:
            raise BusError(f'{self.name} is closed')
        if self._gone:
            self._reopen()
        try:
            message = self._wait(monotonic() + timeout) if timeout > 0.0 else self._next(0.0)
            frames = []
            while message is not None:
                frame = self._accept(message)
                if frame is not None:
                    frames.append(frame)
                message = self._next(0.0) if len(frames) < _BATCH_MAX else None
        except BusError:
            raise
        except (can.CanError, OSError) as error:
            self._gone = True
            raise BusError(
                f'{self.name} went away: {error}; it is opened again when it is back'
            ) from error
        self.counters.received += len(frames)
        return frames

    def _reopen(self) -> None:
        """Resume with the adapter if it is back; some drivers take seconds to open it."""
        if self._reopening is None:
            self._reopening = Future()
            Thread(target=self._replace, args=(self._reopening,), daemon=True).start()
        if not self._reopening.done():
            raise BusError(f'{self.name} went away')
        opened, self._reopening = self._reopening, None
        with self._send_lock:
            self._bus = opened.result()
            self._gone = False
        _log.warning('%s is back', self.name)  # as loud as its going was

    def _replace(self, opened: Future[can.BusABC]) -> None:
        """Release the unplugged adapter, and open it again."""
        with contextlib.suppress(Exception):  # of a driver whose device is gone
            self._bus.shutdown()
        try:
            driver = self._open()
        except BusError as error:
            with contextlib.suppress(InvalidStateError):
                opened.set_exception(error)
            return
        try:
            opened.set_result(driver)
        except InvalidStateError:  # close() has cancelled it
            driver.shutdown()

    def _wait(self, deadline: float) -> can.Message | None:
        message = None
        while message is None and not self._woken.is_set():
            left = deadline - monotonic()
            if left <= 0.0:
                break
            message = self._next(min(left, _POLL))
        self._woken.clear()
        return message

    def _next(self, timeout: float) -> can.Message | None:
        """Return the next message; drop messages that the driver cannot decode.

        Drivers of serial adapters raise various exceptions for a line with a damaged byte.
        """
        try:
            message = self._bus.recv(timeout)
        except Exception as error:
            gone = isinstance(error, (can.CanError, OSError))
            if gone and not isinstance(error.__cause__, UnicodeDecodeError):
                raise
            line = getattr(self._bus, '_buffer', None)
            if isinstance(line, bytearray):  # that is no text; slcan keeps it, and fails for ever
                line.clear()
            self.counters.malformed += 1
            self._damaged += 1
            if self._damaged < _DAMAGED_MAX:
                return None
            raise BusError(
                f'{self.name} delivers damaged messages only, {self._damaged} in a row '
                f'({type(error).__name__}: {error}); do bit rate and protocol of the adapter fit?'
            ) from error
        if message is not None:
            self._damaged = 0
        return message

    def _accept(self, message: can.Message) -> Frame | None:
        if not message.is_rx:
            return None
        size = len(message.data)
        if (
            message.is_fd
            or size > PAYLOAD_MAX
            or not (message.is_remote_frame or size == message.dlc)
        ):
            self.counters.malformed += 1
            return None
        self._last = max(self._last, self._steady(message.timestamp))
        return from_message(message, self._last)

    def _steady(self, stamp: float) -> float:
        """Convert a driver's stamp to the steady clock; stamps off the wall clock become now."""
        now = self._clock.update() * 1e-9
        steady = stamp - self._clock.offset * 1e-9
        return steady if now - _WALL_CLOCK_SPAN < steady <= now else now

    def wake(self) -> None:
        """Wake a waiting :meth:`receive` within 20 ms."""
        self._woken.set()

    def close(self) -> None:
        """Close the adapter."""
        if self._closed:
            return
        self._closed = True
        self._woken.set()
        opened = self._reopening
        if opened is None:
            with contextlib.suppress(can.CanError, OSError):  # of an adapter that takes no bytes
                self._bus.shutdown()
        elif not opened.cancel() and opened.exception() is None:
            opened.result().shutdown()


def to_message(frame: Frame, timestamp: float = 0.0) -> can.Message:
    """Convert a frame to python-can's message; time on the wall clock in [s], 0 for sending."""
    return can.Message(
        timestamp=timestamp,
        arbitration_id=frame.can_id,
        is_extended_id=frame.is_extended,
        is_remote_frame=frame.is_remote,
        is_error_frame=frame.is_error,
        data=frame.data,
        dlc=frame.remote_length or len(frame.data),
    )


def from_message(message: can.Message, timestamp: float) -> Frame:
    """Convert python-can's classic message to a frame with its steady time in [s]."""
    return Frame(
        message.arbitration_id,
        bytes(message.data),
        timestamp,
        message.is_extended_id and not message.is_error_frame,
        message.is_remote_frame,
        message.is_error_frame,
        min(message.dlc, PAYLOAD_MAX) if message.is_remote_frame else 0,
    )


def _open_driver(name: str, interface: str, channel: str, bitrate: int | None) -> can.BusABC:
    options: dict[str, Any] = {} if bitrate is None else {'bitrate': bitrate}
    try:
        return can.Bus(channel=channel, interface=interface, receive_own_messages=False, **options)
    except (can.CanError, NotImplementedError, OSError, ValueError, TypeError) as error:
        message = f'cannot open {name}: {error}; is it plugged in, and is its driver installed?'
        if interface not in can.VALID_INTERFACES:
            known = ', '.join(sorted(can.VALID_INTERFACES))
            message = (
                f'no bus is called {name!r}: python-can has no interface {interface}; it has '
                f'{known}'
            )
        raise BusError(message) from error


def _is_unplugged(error: BaseException | None) -> bool:
    """Return whether a driver's error means that the adapter is unplugged."""
    while error is not None:
        if isinstance(error, OSError) and error.errno in _UNPLUGGED:
            return True
        error = error.__cause__
    return False
