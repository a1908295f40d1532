# SPDX-FileCopyrightText: 2026 The arm and quad developers
# SPDX-License-Identifier: Apache-2.0
"""Begins and ends the faults of one simulated device."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace
from typing import Protocol

from canopen_core.standard import Index, object_address

from .deviations import Fault, FaultInjection
from .drive.drive import Drive
from .line import ActiveFault, FaultLine
from .objects.object_store import ObjectStore
from .timed import NEVER

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
    """What the injector does with its device."""

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
        """Send the last EMCY again and again; 0 ends that."""

    def faults_changed(self) -> None:
        """The line has other faults from now on."""


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
        """The faults that go on."""
        self._forget_exhausted()
        return tuple(active.injection for active in self._active.values())

    def inject(self, injection: FaultInjection, now: float) -> None:
        """Begin a fault; the same fault of the same PDO or object ends.

        Raises:
            ValueError: It is a fault of a drive, and the device is none or lacks the axis; or of
                an object, and the device has no such number.
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
        """End a fault, or all (None); a device without power is switched on."""
        self._line.now = now
        for key, active in list(self._active.items()):
            if fault in (None, active.injection.fault):
                self._active.pop(key, None)
                self._ended(active.injection, now)
        self._update_line()

    def advance(self, now: float) -> None:
        """Deliver late frames, and end the faults whose time is over."""
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
