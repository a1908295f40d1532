# SPDX-FileCopyrightText: 2026 The arm and quad developers
# SPDX-License-Identifier: Apache-2.0
"""Several simulated devices on one bus."""

from __future__ import annotations

from collections import deque
from collections.abc import Callable

from canopen_core.can import Frame
from canopen_core.standard import ObjectDictionary

from .device import Device, RateUnits
from .drive.axis import ServoModel
from .objects.parameter_storage import ParameterMemory
from .services.rpdo import Handler
from .timed import NEVER

DEFECT_PAUSE = 0.1  # [s] after a defect in a device, before it is looked at again


class DeviceHost:
    """Devices that share a connection to a bus; they receive each other too.

    A bus object never receives what it sent itself, so the frames of one device are handed to
    the others here. Each frame goes straight to those who want its identifier.
    """

    def __init__(
        self,
        send: Callable[[Frame], None],
        on_defect: Callable[[Device, Exception], None] | None = None,
    ) -> None:
        """Begin without devices.

        ``on_defect`` gets an exception in a device, while the others go on; without it the
        exception leaves the host.
        """
        self.devices: list[Device] = []  # in the order in which they were added
        self._send = send
        self._on_defect = on_defect
        self._resting: dict[Device, float] = {}  # until when, after a defect
        self._table: dict[int, list[tuple[Device, Handler]]] = {}
        self._outdated = False
        self._echoes: deque[tuple[Device, Frame]] = deque()

    def add(
        self,
        node_id: int,
        dictionary: ObjectDictionary,
        *,
        boot_time: float = 0.0,
        servo: ServoModel | None = None,
        memory: ParameterMemory | None = None,
        rate_units: RateUnits | None = None,
    ) -> Device:
        """Add a device, switched off; the next :meth:`advance` starts it.

        The arguments are those of :class:`~.device.Device`.

        Raises:
            ValueError: The node id is out of range, or another device has it.
        """
        if any(d.node_id == node_id for d in self.devices):
            raise ValueError(f'two devices with node id {node_id}')

        def send(frame: Frame) -> None:
            self._send(frame)
            self._echoes.append((device, frame))

        device = Device(
            node_id,
            dictionary,
            send,
            boot_time=boot_time,
            servo=servo,
            memory=memory,
            rate_units=rate_units,
            handlers_changed=self._outdate,
        )
        self.devices.append(device)
        self._outdate()
        return device

    @property
    def deadline(self) -> float:
        """Steady time in [s] at which :meth:`advance` has something to do."""
        return min((self._due(device) for device in self.devices), default=NEVER)

    def receive(self, frame: Frame, now: float) -> None:
        """Hand a frame from the bus to all devices that want it."""
        self._dispatch(frame, None, now)
        self._dispatch_echoes(now)

    def advance(self, now: float) -> None:
        """Process what is due at steady time ``now`` in [s]."""
        for device in self.devices:
            if self._due(device) <= now:
                self._resting.pop(device, None)
                try:
                    device.advance(now)
                except Exception as error:  # noqa: BLE001  # the other devices go on
                    self._defect(device, error, now)
        self._dispatch_echoes(now)

    def postpone_watches(self, stalled: float) -> None:
        """Postpone time-outs by the time in [s] for which this computer stood still."""
        for device in self.devices:
            device.postpone_watches(stalled)

    def device(self, node_id: int) -> Device:
        """Return the device with a node id.

        Raises:
            KeyError: There is none.
        """
        for device in self.devices:
            if device.node_id == node_id:
                return device
        raise KeyError(node_id)

    def _due(self, device: Device) -> float:
        deadline = device.deadline
        return max(deadline, self._resting[device]) if device in self._resting else deadline

    def _defect(self, device: Device, error: Exception, now: float) -> None:
        if self._on_defect is None:
            raise error
        self._on_defect(device, error)
        self._resting[device] = now + DEFECT_PAUSE  # what is due stays due

    def _outdate(self) -> None:
        self._outdated = True

    def _dispatch_echoes(self, now: float) -> None:
        # after the frame that caused them, which everybody has got by then
        while self._echoes:
            origin, echo = self._echoes.popleft()
            self._dispatch(echo, origin, now)

    def _dispatch(self, frame: Frame, origin: Device | None, now: float) -> None:
        if frame.is_remote or frame.is_extended or frame.is_error:
            wanted: list[tuple[Device, Handler]] = [
                (device, device.receive) for device in self.devices if device is not origin
            ]
        else:
            if self._outdated:
                self._rebuild()
            wanted = [
                (device, handler)
                for device, handler in self._table.get(frame.can_id, ())
                if device is not origin
            ]
        for device, handler in wanted:
            try:
                handler(frame, now)
            except Exception as error:  # noqa: BLE001, PERF203  # the other devices go on
                self._defect(device, error, now)

    def _rebuild(self) -> None:
        self._outdated = False
        self._table = {}
        for device in self.devices:
            for can_id, handler in device.handlers.items():
                self._table.setdefault(can_id, []).append((device, handler))
