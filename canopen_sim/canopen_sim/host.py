# SPDX-FileCopyrightText: 2026 The arm and quad developers
# SPDX-License-Identifier: Apache-2.0
"""Simulated devices on one bus: distribution of frames, their thread, and a whole bus.yml."""

from __future__ import annotations

from collections import deque
from collections.abc import Callable, Iterable, Iterator, Mapping, Sequence
import contextlib
from contextlib import contextmanager
import logging
from pathlib import Path
import time

from arm_canopen.config import BusConfig, load_bus, rate_units, reported_increments
from canopen_core import BusError, CanopenError
from canopen_core.can import Bus, BusThread, Frame, open_bus
from canopen_core.standard import CobId, Index, NODE_ID_MAX, ObjectDictionary, sdo

from .device import Device, RateUnits
from .drive.axis import ServoModel
from .object_store import NEVER, ParameterMemory
from .pdo import Handler

DEFECT_PAUSE = 0.1  # [s] after a defect in a device, before it is looked at again


class DeviceHost:
    """Devices that share a connection to a bus; they receive each other too.

    A bus object never receives its own frames, so the host passes frames of one device to the
    others. Each frame goes directly to the devices that handle its identifier.
    """

    def __init__(
        self,
        send: Callable[[Frame], None],
        on_defect: Callable[[Device, Exception], None] | None = None,
    ) -> None:
        """Create a host without devices.

        ``on_defect`` is called with an exception of a device, and the others continue; without it
        the host raises the exception.
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
        """Steady time in [s] at which :meth:`advance` is due."""
        return min((self._due(device) for device in self.devices), default=NEVER)

    def receive(self, frame: Frame, now: float) -> None:
        """Pass a frame from the bus to all devices that handle it."""
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
        """Postpone time-outs by a time in [s] during which this computer stood still."""
        for device in self.devices:
            device.postpone_watches(stalled)

    def device(self, node_id: int) -> Device:
        """Return the device with a node id.

        Raises:
            KeyError: There is no such device.
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


IDLE_WAIT = 1.0  # [s] longest wait when no device has a deadline
STALL = 0.1  # [s] without a processor from which on devices count as having stood still

logger = logging.getLogger(__name__)


class DeviceRunner(BusThread):
    """Waits for frames and deadlines, and passes them to the devices of a host.

    If the bus disappears (interface down), the devices keep running like real ones until it is
    back. An exception in one device is logged, and the others continue.
    """

    def __init__(self, bus: Bus) -> None:
        """Prepare; :meth:`start` starts the thread, and the caller closes the bus."""
        super().__init__(bus, 'devices', self._serve, 'the simulation')
        # the devices; add them before :meth:`start`, and leave them to the thread then:
        # :meth:`call` gets at them
        self.host = DeviceHost(self._send, _log_defect)

    @property
    def bus_name(self) -> str:
        """Name of the bus, in the syntax of `can_interface_name`."""
        return self._bus.name

    def _serve(self) -> None:
        host, woken = self.host, time.monotonic()
        while not self.stopping:
            host.advance(time.monotonic())
            self.do_work()
            rest = time.monotonic()
            due = min(host.deadline, rest + IDLE_WAIT)
            frames = self.receive(max(0.0, due - rest))
            now = time.monotonic()
            first = frames[0].timestamp or now if frames else due
            stalled = (rest - woken) + max(0.0, now - max(rest, min(due, first)))
            woken = now
            for frame in _pass_over(frames, now) if now - first > STALL else frames:
                host.receive(frame, frame.timestamp or now)
            if stalled > STALL:
                host.postpone_watches(stalled)

    def _send(self, frame: Frame) -> None:
        try:
            self._bus.send(frame)
        except BusError as error:
            self.note_failure(error)


def _pass_over(frames: list[Frame], now: float) -> list[Frame]:
    """Return the frames that devices receive after this process was not scheduled."""
    kept = newest_process_data(frames)
    syncs = sum(frame.can_id == CobId.SYNC for frame in frames)
    if len(kept) == len(frames):
        return frames
    logger.warning(
        'the simulated devices got no processor for %.2f s: %d SYNC and %d other frames of '
        'process data are passed over, as by the mailboxes of a CAN controller',
        now - (frames[0].timestamp or now),
        max(0, syncs - 1),
        len(frames) - len(kept) - max(0, syncs - 1),
    )
    return kept


def newest_process_data(frames: Sequence[Frame]) -> list[Frame]:
    """Return the frames that a CAN controller's mailboxes would keep if they are not read in time.

    A device that stood still receives only the newest set-point, not all previous ones. SDO and
    NMT frames are all kept, because clients wait for responses.
    """
    newest = {frame.can_id: frame for frame in frames}
    return [
        frame
        for frame in frames
        if not _is_process_data(frame.can_id) or newest[frame.can_id] is frame
    ]


def _is_process_data(can_id: int) -> bool:
    heartbeat = 0 < can_id - CobId.HEARTBEAT <= NODE_ID_MAX
    return CobId.SYNC <= can_id < CobId.SDO_RESPONSE or heartbeat


def _log_defect(device: Device, error: Exception) -> None:
    logger.error('a defect in the simulated device %d', device.node_id, exc_info=error)


ANSWER_TIME = 0.15  # [s] a device answers an SDO within some milliseconds, unless it is too busy
EVIDENCE = {CobId.SDO_RESPONSE: 'SDO response', CobId.HEARTBEAT: 'heartbeat or boot-up'}
"""Frames that only the device with the node id sends, by their first identifier."""


class NodeIdCheck:
    """Checks whether node ids are taken on the bus, in parallel with other start-up work."""

    def __init__(
        self, bus: Bus, node_ids: Iterable[int], clock: Callable[[], float] = time.monotonic
    ) -> None:
        """Send a request to each node id; frames received earlier count as well.

        The bus must not have another reader.
        """
        self.found: dict[int, str] = {}  # what was received from them, in words, by identifier
        self._bus = bus
        self._clock = clock
        ids = [*node_ids]
        self._known = {
            base + node_id: f'{name} (0x{base + node_id:03X}) of node id {node_id}'
            for base, name in EVIDENCE.items()
            for node_id in ids
        }
        self._until = clock() + ANSWER_TIME
        self._receive(0.0)
        with contextlib.suppress(BusError):  # a bus that is down has no devices
            for node_id in [] if self.found else ids:
                request = sdo.UploadRequest(Index.DEVICE_TYPE, 0).encode()
                bus.send(Frame(CobId.SDO_REQUEST + node_id, request))

    def finish(self) -> None:
        """Wait until every device should have responded.

        Raises:
            CanopenError: A node id is taken; the message names the frames and the remedy.
        """
        readable = self._receive(0.0)  # what came beside other work, however long that took
        while readable and not self.found and (left := self._until - self._clock()) > 0.0:
            readable = self._receive(left)
        if self.found:
            raise CanopenError(
                f'{self._bus.name} has devices with these node ids already; received: '
                f'{", ".join(self.found[can_id] for can_id in sorted(self.found))}. End the other '
                'simulated devices (fake_slaves, bringup --simulate), or choose another '
                'can_interface_name'
            )

    def _receive(self, timeout: float) -> bool:
        """Check received frames; return whether the bus can be read."""
        try:
            frames = self._bus.receive(timeout)
        except BusError:
            return False
        for frame in frames:
            plain = not (frame.is_remote or frame.is_extended or frame.is_error)
            if plain and frame.can_id in self._known:
                self.found[frame.can_id] = self._known[frame.can_id]
        return True


NO_POSITIONS: Mapping[str, float] = {}


def add_devices(
    host: DeviceHost,
    bus: BusConfig,
    positions: Mapping[str, float] = NO_POSITIONS,
    memory: Callable[[int], ParameterMemory] | None = None,
) -> None:
    """Add the devices of a bus to a host, switched off.

    ``positions`` are initial positions of axes, by name, in the units of bus.yml [rad or m], as
    reported by their absolute encoders; other axes report 0 increments. ``memory`` creates the
    non-volatile memory of a node id.

    Raises:
        CanopenError: The bus has no such axis, or it cannot report such a position.
    """
    if unknown := [name for name in positions if name not in bus.joints]:
        known = ', '.join(bus.joints) or 'none'
        raise CanopenError(f'positions: no drive {unknown[0]!r} in {bus.file}; drives: {known}')
    for node in bus.nodes:
        axes = node.axes if node.is_drive else ()
        device = host.add(
            node.node_id,
            node.dictionary,
            memory=None if memory is None else memory(node.node_id),
            rate_units={axis.channel: rate_units(bus, node, axis) for axis in axes},
        )
        drives = {drive.number: drive for drive in device.drives}
        for axis in axes:
            if axis.name not in positions:
                continue
            if axis.channel not in drives:
                raise CanopenError(f'positions: the EDS of {node.name} has no axis {axis.name}')
            try:
                increments = reported_increments(bus, node, axis, positions[axis.name])
            except ValueError as error:
                raise CanopenError(f'positions: {error}') from error
            drives[axis.channel].count_from(increments)


@contextmanager
def simulated_devices(
    bus_config: str | Path, bus: str = 'auto', positions: Mapping[str, float] = NO_POSITIONS
) -> Iterator[DeviceRunner]:
    """Simulate the devices of a bus.yml on a bus, in a thread that ends with the context.

    The bus is named as for :func:`canopen_core.can.open_bus`. ``positions`` are initial positions
    of drives, by name, in the units of bus.yml [rad or m].

    Yields:
        The runner; use ``runner.call`` to access ``runner.host.devices``.

    Raises:
        ConfigError: The bus.yml or an EDS is wrong.
        BusError: The bus cannot be opened.
        CanopenError: A drive is unknown or cannot report its initial position, or devices with
            these node ids are already on the bus.
    """
    config = load_bus(bus_config)
    with open_bus(bus) as can:
        runner = DeviceRunner(can)
        add_devices(runner.host, config, positions)
        NodeIdCheck(can, [device.node_id for device in runner.host.devices]).finish()
        runner.start()
        try:
            yield runner
        finally:
            runner.stop()
