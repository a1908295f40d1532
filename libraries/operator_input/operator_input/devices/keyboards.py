# SPDX-FileCopyrightText: 2026 The arm and quad developers
# SPDX-License-Identifier: Apache-2.0
"""All keyboards of this machine that may be read: which key goes down, and which goes up."""

from __future__ import annotations

import contextlib

from ..exceptions import DeviceError
from ..keys import KeyEvent
from .events import EV_KEY, EV_SYN, InputDevice, InputDevices, SYN_DROPPED
from .release_matcher import ReleaseMatcher

KEY_Q, KEY_SPACE = 16, 57  # what has these is a keyboard, not a power button
SCAN_PERIOD = 2.0  # [s] between two looks for keyboards that were plugged in
OTHERS_PERIOD = 20.0  # [s] for which a device that is no keyboard is not opened again


class Keyboards:
    """Keeps the keyboards open, and feeds a matcher with their keys."""

    def __init__(self, devices: InputDevices, matcher: ReleaseMatcher) -> None:
        """Start without any.

        Args:
            devices: Where to look for them.
            matcher: What takes their keys.
        """
        self._devices = devices
        self._matcher = matcher
        self._open: dict[str, InputDevice] = {}
        self._others: dict[str, float] = {}  # until when [s] a path is passed over
        self._next_scan = float('-inf')

    @property
    def names(self) -> list[str]:
        """The names of the keyboards."""
        return [device.info.name for device in self._open.values()]

    def filenos(self) -> list[int]:
        """Return what to wait for."""
        return [device.fileno() for device in self._open.values()]

    def scan(self, now: float) -> None:
        """Look for new keyboards, if it is time to.

        Args:
            now: Time [s].
        """
        if now < self._next_scan:
            return
        self._next_scan = now + SCAN_PERIOD
        for path in self._devices.paths():
            if path not in self._open and now >= self._others.get(path, now):
                with contextlib.suppress(DeviceError):
                    self._add(self._devices.open(path), now)

    def read(self, now: float) -> list[KeyEvent]:
        """Read what has come, without waiting.

        Args:
            now: Time [s].
        """
        events: list[KeyEvent] = []
        for path, device in list(self._open.items()):
            with contextlib.suppress(DeviceError):
                events += self._read(device, now)
                continue
            device.close()
            del self._open[path]
            events += self._matcher.lose_all(now)
        return events

    def close(self) -> None:
        """Let go of every keyboard that is open."""
        for device in self._open.values():
            device.close()
        self._open.clear()

    def _add(self, device: InputDevice, now: float) -> None:
        if {KEY_Q, KEY_SPACE} <= device.info.keys:
            self._open[device.info.path] = device
        else:
            self._others[device.info.path] = now + OTHERS_PERIOD
            device.close()

    def _read(self, device: InputDevice, now: float) -> list[KeyEvent]:
        events: list[KeyEvent] = []
        for event in device.read():
            if event.type == EV_SYN and event.code == SYN_DROPPED:
                events += self._matcher.lose_all(now)  # an up may be among what was dropped
            elif event.type == EV_KEY and event.value == 1:
                events += self._matcher.key_down(event.code, now)
            elif event.type == EV_KEY and event.value == 0:
                events += self._matcher.key_up(event.code, now)
        return events
