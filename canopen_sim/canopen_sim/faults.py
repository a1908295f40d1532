# SPDX-FileCopyrightText: 2026 The arm and quad developers
# SPDX-License-Identifier: Apache-2.0
"""Faults of one simulated device: a line that loses and changes frames, and the injector."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import replace
from functools import partial
import heapq
import itertools
import random
import struct
from typing import NamedTuple, Protocol

from canopen_core.can import Frame
from canopen_core.standard import Index, object_address, sdo

from .deviations import Effect, Fault, FaultInjection, FRAME_BYTES, Service
from .drive.drive import Drive
from .object_store import NEVER, ObjectStore

Deliver = Callable[[Frame, float], None]

SDO_INITIATIONS = (1, 2, 5, 6)  # client command specifiers that name an object (CiA 301, 7.2.4.3)
SDO_ANSWERS = (2, 3, 4, 5, 6)  # server command specifiers that do
BLOCK_TRANSFERS = (5, 6)  # client command specifiers of block transfers
OTHER_DEVICE_DELAY = 0.0005  # [s] by which another device of the same node id answers later


class Traffic(NamedTuple):
    """Role of a frame for its device."""

    service: Service  # its kind
    outgoing: bool  # the device sends it
    number: int = 0  # number of the PDO, from 1


class ActiveFault:
    """An active fault."""

    def __init__(self, injection: FaultInjection, node_id: int, end: float) -> None:
        """Start the fault; each device and fault has its own random numbers."""
        self.injection = injection  # its description
        self.end = end  # steady time in [s] at which it ends
        self.exhausted = False  # it hit as many frames as it was to hit
        self._left = injection.count
        seed = f'{injection.seed}/{node_id}/{injection.fault.label}/{injection.pdo}'
        self._random = random.Random(seed)  # noqa: S311  # repeatable noise, no secret

    def hits(self, frame: Frame, traffic: Traffic) -> bool:
        """Return whether the fault hits a frame, and count the frame."""
        if self.exhausted or not self._concerns(frame, traffic):
            return False
        probability = self.injection.probability
        if probability < 1.0 and self._random.random() >= probability:
            return False
        self._left -= 1
        self.exhausted = self._left == 0
        return True

    def _concerns(self, frame: Frame, traffic: Traffic) -> bool:
        injection, kind = self.injection, self.injection.fault.value
        if traffic.service not in kind.services or traffic.outgoing not in kind.directions:
            return False
        if kind.of_blocks:
            return frame.data[0] >> 5 in BLOCK_TRANSFERS if frame.data else False
        if kind.effect is Effect.ABORT or injection.object is not None:
            named = sdo_object(frame.data, SDO_ANSWERS if traffic.outgoing else SDO_INITIATIONS)
            return named is not None and injection.object in (None, named)
        return injection.pdo in (0, traffic.number)


def sdo_object(data: bytes, specifiers: tuple[int, ...]) -> tuple[int, int] | None:
    """Return the object that an SDO frame names; None if it continues a transfer.

    ``specifiers`` are the command specifiers of its direction that name an object.
    """
    if len(data) < FRAME_BYTES or data[0] >> 5 not in specifiers:
        return None
    index, subindex = struct.unpack_from('<xHB', data)
    return int(index), int(subindex)


class FaultLine:
    """Passes frames on, unless a fault prevents it."""

    def __init__(
        self,
        send: Callable[[Frame], None],
        abort: Callable[[sdo.Abort], None],
        identify: Callable[[Frame, bool], Traffic],
    ) -> None:
        """Create a line without faults; ``identify`` also gets whether a frame is outgoing."""
        self.faults: list[ActiveFault] = []  # the faults of the line that go on
        # steady time in [s] of what the device does at the moment; its owner keeps it
        self.now = 0.0
        self._send = send
        self._abort = abort
        self._identify = identify
        self._late: list[tuple[float, int, Callable[[float], None]]] = []
        self._order = itertools.count()

    @property
    def deadline(self) -> float:
        """Steady time in [s] at which the next delayed frame arrives."""
        return self._late[0][0] if self._late else NEVER

    def send(self, frame: Frame) -> None:
        """Pass on a frame of the device."""
        if self.faults:
            self._pass(frame, self._send_at, outgoing=True)
        else:
            self._send(frame)

    def receive(self, frame: Frame, now: float, deliver: Deliver) -> None:
        """Deliver a frame to the device unless a fault prevents it."""
        self.now = now
        self._pass(frame, deliver, outgoing=False)

    def filtered(self, deliver: Deliver) -> Deliver:
        """Return a handler that passes through this line."""
        return lambda frame, now: self.receive(frame, now, deliver)

    def clear(self) -> None:
        """Drop all delayed frames."""
        self._late.clear()

    def advance(self, now: float) -> None:
        """Deliver delayed frames that are due."""
        self.now = now
        while self._late and self._late[0][0] <= now:
            heapq.heappop(self._late)[2](now)

    def _pass(self, frame: Frame, deliver: Deliver, *, outgoing: bool) -> None:
        """Apply the faults to a frame; deliver the result now or delayed."""
        traffic = self._identify(frame, outgoing)
        delay = 0.0
        for fault in self.faults:
            if not fault.hits(frame, traffic):
                continue
            match fault.injection.fault.value.effect:
                case Effect.DELAY:
                    delay += fault.injection.delay
                case Effect.REPEAT:
                    self._postpone(OTHER_DEVICE_DELAY, partial(self._send_at, frame))
                case Effect.ABORT:
                    index, subindex = sdo_object(frame.data, SDO_INITIATIONS) or (0, 0)
                    self._abort(sdo.Abort(index, subindex, fault.injection.abort))
                    return
                case Effect.LOSE:
                    return
                case rewrite:
                    frame = frame._replace(data=rewrite(frame.data))
        if delay:
            self._postpone(delay, partial(deliver, frame))
        else:
            deliver(frame, self.now)

    def _send_at(self, frame: Frame, _now: float) -> None:
        self._send(frame)

    def _postpone(self, delay: float, work: Callable[[float], None]) -> None:
        heapq.heappush(self._late, (self.now + delay, next(self._order), work))


IDENTITY_OBJECTS: dict[str, tuple[int, int]] = {
    'device_type': (Index.DEVICE_TYPE, 0),
    'vendor': (Index.IDENTITY, 1),
    'product': (Index.IDENTITY, 2),
    'revision': (Index.IDENTITY, 3),
    'serial': (Index.IDENTITY, 4),
}
"""Objects of the identity, by the field of the injection (CiA 301, 7.5.2.2 and 7.5.2.18)."""

POWER_FAULTS = frozenset({Fault.POWER_OFF, Fault.REBOOT})
REBOOT_TIME_MIN = 1e-6  # [s] so that off comes before on
FLOOD_PERIOD_MIN = 1e-3  # [s] a bus carries not many more frames
OTHER_VENDOR = 0x7FFF_FFFF  # what a wrong identity shows when no value is given


class Powered(Protocol):
    """Interface of a device for the injector."""

    node_id: int
    store: ObjectStore

    @property
    def drives(self) -> Sequence[Drive]:
        """Its axes."""

    def switch_off(self, now: float) -> None:
        """Cut the power."""

    def switch_on(self, now: float, *, position_kept: bool) -> None:
        """Restore the power."""

    def repeat_emcy(self, period: float, now: float) -> None:
        """Repeat the last EMCY periodically; 0 stops that."""

    def faults_changed(self) -> None:
        """Notify the device that the faults of its line have changed."""


class FaultInjector:
    """All faults of one device."""

    def __init__(self, device: Powered, line: FaultLine) -> None:
        self._device = device
        self._line = line
        self._active: dict[object, ActiveFault] = {}

    @property
    def deadline(self) -> float:
        """Steady time in [s] at which a fault ends or a late frame arrives."""
        if not self._active:
            return self._line.deadline
        return min(self._line.deadline, *(active.end for active in self._active.values()))

    @property
    def active(self) -> tuple[FaultInjection, ...]:
        """The active faults."""
        self._forget_exhausted()
        return tuple(active.injection for active in self._active.values())

    def inject(self, injection: FaultInjection, now: float) -> None:
        """Inject a fault; it replaces the same fault of the same PDO or object.

        Raises:
            ValueError: The fault needs a drive axis or an object that the device does not
                have.
        """
        self._line.now = now
        fault, kind = injection.fault, injection.fault.value
        if kind.of_drive and not self._axes(injection):
            raise ValueError(
                f'device {self._device.node_id} has {len(self._device.drives)} axes; '
                f'{fault.label} needs one'
            )
        if fault in POWER_FAULTS:
            self._cut_power(injection, now)
            return
        if fault is Fault.WRONG_IDENTITY:
            self._disguise(injection)
        elif fault is Fault.OBJECT_KEPT:
            self._keep(injection)
        elif fault is Fault.EMCY_FLOOD:
            self._device.repeat_emcy(max(injection.delay, FLOOD_PERIOD_MIN), now)
        for drive in self._axes(injection) if kind.of_drive else ():
            drive.inject(injection, now)
        if injection.lasting:
            self._go_on(injection, injection.duration, now)
            self._update_line()

    def end(self, now: float, fault: Fault | None = None) -> None:
        """End a fault, or all faults (None); switch a device without power on."""
        self._line.now = now
        for key, active in list(self._active.items()):
            if fault in (None, active.injection.fault):
                self._active.pop(key, None)
                self._ended(active.injection, now)
        self._update_line()

    def advance(self, now: float) -> None:
        """Deliver delayed frames, and end faults that have expired."""
        self._line.advance(now)
        over = [key for key, active in self._active.items() if active.end <= now]
        for key in over:
            active = self._active.pop(key, None)
            if active is not None:
                self._ended(active.injection, now)
        if over:
            self._update_line()

    def _ended(self, injection: FaultInjection, now: float) -> None:
        store = self._device.store
        if injection.fault.value.of_drive:
            for drive in self._axes(injection):
                drive.clear(injection.fault, now)
        elif injection.fault is Fault.WRONG_IDENTITY:
            for address in IDENTITY_OBJECTS.values():
                store.overlay.pop(address, None)
        elif injection.fault is Fault.OBJECT_KEPT and injection.object is not None:
            store.saved.pop(injection.object, None)
            store.find(*injection.object).restore()
        elif injection.fault is Fault.EMCY_FLOOD:
            self._device.repeat_emcy(0.0, now)
        elif injection.fault in POWER_FAULTS:
            self._device.switch_on(now, position_kept=injection.position_kept)

    def _axes(self, injection: FaultInjection) -> Sequence[Drive]:
        drives = self._device.drives
        return drives[injection.axis - 1 : injection.axis] if injection.axis else drives

    def _cut_power(self, injection: FaultInjection, now: float) -> None:
        duration = injection.duration
        if injection.fault is Fault.REBOOT:
            duration = max(duration, REBOOT_TIME_MIN)
        for fault in POWER_FAULTS:  # off is off, however often it is requested
            self._active.pop(replace(injection, fault=fault).key, None)
        self._device.switch_off(now)
        self._go_on(injection, duration, now)

    def _go_on(self, injection: FaultInjection, duration: float, now: float) -> None:
        end = now + duration if duration else NEVER
        self._active[injection.key] = ActiveFault(injection, self._device.node_id, end)

    def _disguise(self, injection: FaultInjection) -> None:
        store = self._device.store
        shown = {name: getattr(injection, name) for name in IDENTITY_OBJECTS}
        if all(value is None for value in shown.values()):
            shown['vendor'] = OTHER_VENDOR
        for name, address in IDENTITY_OBJECTS.items():
            value = shown[name]
            if value is None or address not in store:
                store.overlay.pop(address, None)
            else:
                store.overlay[address] = int(value).to_bytes(4, 'little')

    def _keep(self, injection: FaultInjection) -> None:
        if injection.object is None:
            raise ValueError(f"{injection.fault.label} needs an 'object'")
        store = self._device.store
        variable = store.integer(*injection.object)
        low, high = variable.low, variable.high
        if injection.object not in store or not low <= injection.value <= high:
            raise ValueError(
                f'{object_address(*injection.object)} of device {self._device.node_id} cannot '
                f'hold {injection.value}'
            )
        store.saved[injection.object] = variable.value = injection.value

    def _forget_exhausted(self) -> None:
        self._active = {
            key: active for key, active in self._active.items() if not active.exhausted
        }

    def _update_line(self) -> None:
        self._forget_exhausted()
        faults = self._active.values()
        self._line.faults = [fault for fault in faults if fault.injection.fault.value.services]
        self._device.faults_changed()
