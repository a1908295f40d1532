# SPDX-FileCopyrightText: 2026 The arm and quad developers
# SPDX-License-Identifier: Apache-2.0
"""A simulated CANopen device, driven by calls; it owns no bus, thread or clock."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from functools import partial

from arm_canopen.config import FactorGroup
from canopen_core.can import Frame
from canopen_core.standard import (
    AXIS_OFFSET,
    CobId,
    DeviceProfile,
    DIGITAL_OUTPUTS,
    drive_axes,
    EncoderObject,
    ERROR_OBJECTS,
    integer_range,
    IO_GROUPS,
    is_drive,
    NmtCommand,
    NmtState,
    NODE_ID_MAX,
    NODE_ID_MIN,
    ObjectDictionary,
    profile_number,
    sdo,
)

from .deviations import Service
from .drive.axis import ServoModel
from .drive.drive import Drive
from .faults import FaultInjector, FaultLine, Traffic
from .messages import EmcyProducer, SyncConsumer, TimeConsumer
from .nmt import ErrorControl, NmtSlave
from .object_store import ObjectStore, ParameterMemory, ParameterStorage, Scalar, Timed, Variable
from .pdo import Handler, RpdoEngine, TpdoEngine
from .sdo_server import SdoServers

RateUnits = Mapping[int, tuple[float, float]]
"""By axis: its unit of velocity in [inc/s], and its unit of acceleration in [inc/s^2]."""
SYNC_LENGTH_ERROR = 0x8240
COMMUNICATION_OBJECTS = (0x1000, 0x1FFF)
ALL_OBJECTS = (0x0000, 0xFFFF)


class Device:
    """A CANopen device built from an object dictionary; if that has 0x6040, it is a drive.

    Call :meth:`advance` once to switch it on, then at each :attr:`deadline`, and :meth:`receive`
    for each frame. All times are on the steady clock in [s].
    """

    def __init__(
        self,
        node_id: int,
        dictionary: ObjectDictionary,
        send: Callable[[Frame], None],
        *,
        boot_time: float = 0.0,
        servo: ServoModel | None = None,
        handlers_changed: Callable[[], None] | None = None,
        memory: ParameterMemory | None = None,
        rate_units: RateUnits | None = None,
    ) -> None:
        """Build a device that is switched off.

        Args:
            dictionary: Object dictionary, as returned by load_eds.
            send: Called with each frame that the device sends.
            boot_time: Duration of Initialisation in [s].
            handlers_changed: Called after :attr:`handlers` was replaced.
            memory: Non-volatile memory; by default it lasts as long as the device object.
            rate_units: Units of the axes that differ from those in the EDS.

        Raises:
            ValueError: The node id is out of range.
        """
        if not NODE_ID_MIN <= node_id <= NODE_ID_MAX:
            raise ValueError(f'node id {node_id} is not {NODE_ID_MIN} to {NODE_ID_MAX}')
        self._memory = memory or ParameterMemory()
        self._handlers_changed = handlers_changed
        self.node_id = node_id  # CANopen node id
        # the handler of each identifier in the present NMT state; another mapping replaces it when
        # that changes
        self.handlers: Mapping[int, Handler] = {}
        # present values of all objects
        self.store = ObjectStore(dictionary.for_node(self.node_id))
        self._line = FaultLine(send, self._send_abort, self._identify)
        self._send = self._line.send
        self._nmt = NmtSlave(self.node_id, self._reset, self._nmt_changed, boot_time)
        self._errors = EmcyProducer(self.store, self._send)
        self._sync = SyncConsumer(
            self.store,
            self._on_sync,
            partial(self._errors.set_error, SYNC_LENGTH_ERROR),
            self._subscribe,
        )
        # its axes; none when the device is not a drive
        self.drives = tuple(
            Drive(
                self.store,
                self._errors,
                self._sync,
                servo or ServoModel(),
                number=axis,
                rate_units=(rate_units or {}).get(axis) or self._own_rate_units(axis),
            )
            for axis in (drive_axes(dictionary) if is_drive(dictionary) else ())
        )
        self._application = make_application(self.store)
        self._build_services()
        # its deviations, which :class:`FaultInjector` begins and ends
        self.faults = FaultInjector(self, self._line)
        self._powered_parts: list[Timed] = [
            self.faults,
            self._nmt,
            self._sdo,
            self._errors,
            self._error_control,
            self._rpdos,
            self._tpdos,
            *self.drives,
        ]
        self._parts = self._powered_parts

    def _own_rate_units(self, axis: int) -> tuple[float, float]:
        """Return the units of velocity and acceleration given in the EDS."""

        def default(index: int, subindex: int) -> int | None:
            entry = self.store.dictionary.get(index + axis * AXIS_OFFSET, subindex)
            return entry.default if entry is not None and isinstance(entry.default, int) else None

        return FactorGroup.read(default).rate_units

    def _build_services(self) -> None:
        node_id, store, send, nmt = self.node_id, self.store, self._send, self._nmt
        self._sdo = SdoServers(node_id, store, send, self._subscribe)
        self._error_control = ErrorControl(
            store,
            nmt,
            self._errors,
            lost=self._connection_lost,
            send=send,
            subscribe=self._subscribe,
        )
        self._storage = ParameterStorage(store, self._memory)
        self._storage.load()
        self.clock = TimeConsumer(store, self._subscribe)  # what it knows of the network's time
        self._rpdos = RpdoEngine(
            store, self._subscribe, self._errors.set_error, self._sync.window_closed
        )
        self._tpdos = TpdoEngine(store, self._subscribe, send)

    @property
    def drive(self) -> Drive | None:
        """The first axis; None if the device is not a drive."""
        return self.drives[0] if self.drives else None

    @property
    def nmt_state(self) -> NmtState:
        """NMT state; BOOT_UP stands for Initialisation."""
        return self._nmt.state

    @property
    def powered(self) -> bool:
        """Whether the device has power."""
        return self._parts is self._powered_parts

    @property
    def deadline(self) -> float:
        """Steady time in [s] at which :meth:`advance` is due."""
        return min(part.deadline for part in self._parts)

    def next_deadline(self) -> float | None:
        """Return :attr:`deadline`, or None if the device only waits for frames."""
        deadline = self.deadline
        return None if deadline == float('inf') else deadline

    def receive(self, frame: Frame, now: float) -> None:
        """Process a frame from the bus; ignore frames for other devices."""
        if frame.is_extended or frame.is_error:
            return
        if frame.is_remote:
            if self.powered:
                self._line.receive(frame, now, self._on_remote)
            return
        handler = self.handlers.get(frame.can_id)
        if handler is not None:
            handler(frame, now)

    def advance(self, now: float) -> None:
        """Process what is due at steady time ``now`` in [s]."""
        self._line.now = now
        if self.powered:
            self._refresh(now)
        for part in self._parts:
            if part.deadline <= now:
                part.advance(now)
        self._tpdos.poll(now)

    def postpone_watches(self, stalled: float) -> None:
        """Postpone time-outs by a time in [s] during which this computer stood still."""
        self._error_control.postpone(stalled)
        self._rpdos.postpone(stalled)

    def switch_off(self, now: float) -> None:
        """Cut the power: the device becomes silent, and the motor coasts."""
        if not self.powered:
            return
        self._line.clear()
        self._errors.reset()
        self._errors.allow(False, now)
        self._error_control.stop()
        self._error_control.reset()
        self._rpdos.stop(now)
        self._tpdos.stop()
        for drive in self.drives:
            drive.reset(now)
        self._nmt.switch_off()
        self._parts = [self.faults]
        self._subscribe()

    def switch_on(self, now: float, *, position_kept: bool = True) -> None:
        """Restore the power: the device boots with the default values of its objects.

        Without ``position_kept`` the encoder loses the motor position, and counts from 0.
        """
        if self.powered:
            return
        if not position_kept:
            for drive in self.drives:
                drive.count_from(0.0, now)
        self._parts = self._powered_parts
        self._subscribe()
        self.advance(now)

    def repeat_emcy(self, period: float, now: float) -> None:
        """Repeat the last EMCY periodically; 0 stops that (called by the injector)."""
        self._errors.repeat(period, now)

    def faults_changed(self) -> None:
        """Apply the faults of the line to frames (called by the injector)."""
        self._subscribe()

    def _reset(self, command: NmtCommand, now: float) -> None:
        """Restore the defaults of the whole device or of its communication objects."""
        whole = command is NmtCommand.RESET_NODE
        self._error_control.stop()
        self._rpdos.stop(now)
        self._tpdos.stop()
        self.clock.reset()
        self.store.restore(*(ALL_OBJECTS if whole else COMMUNICATION_OBJECTS))
        self._errors.reset()
        self._errors.allow(False, now)
        self._sdo.reset()
        self._sdo.configure()
        self._sync.reset()
        self._rpdos.configure()
        self._tpdos.configure()
        for drive in self.drives:
            if whole:
                drive.reset(now)
            else:
                drive.connection_lost(now)
                for code in sorted(drive.faults):
                    self._errors.report(code, now, drive)
        self._error_control.reset()
        self._subscribe()

    def _nmt_changed(self, previous: NmtState, now: float) -> None:
        """Start and stop services as the NMT state requires (CiA 301, table 46)."""
        state = self._nmt.state
        if previous is NmtState.BOOT_UP:
            self._send(Frame(CobId.HEARTBEAT + self.node_id, bytes((NmtState.BOOT_UP,))))
            self._error_control.start(now)
            for drive in self.drives:
                drive.start(now)
        if state is NmtState.STOPPED:
            self._sdo.reset()
            self._connection_lost(now)
        self._errors.allow(state is not NmtState.STOPPED, now)
        if state is NmtState.OPERATIONAL:
            self._rpdos.start()
            self._tpdos.start(now)
        else:
            self._rpdos.stop(now)
            self._tpdos.stop()
        self._subscribe()

    def _connection_lost(self, now: float) -> None:
        for drive in self.drives:
            drive.connection_lost(now)
        self._application.connection_lost()

    def _subscribe(self) -> None:
        """Register the handlers of the present NMT state."""
        handlers = self._present_handlers() if self.powered else {}
        if self._line.faults:
            filtered = self._line.filtered
            handlers = {can_id: filtered(handler) for can_id, handler in handlers.items()}
        self.handlers = handlers
        if self._handlers_changed is not None:
            self._handlers_changed()

    def _present_handlers(self) -> dict[int, Handler]:
        """Map each identifier to its handler in this NMT state (CiA 301, table 46)."""
        state = self._nmt.state
        handlers: dict[int, Handler] = {
            CobId.NMT: self._nmt.receive,
        }
        if state is not NmtState.BOOT_UP:
            watched = self._error_control
            handlers.update(dict.fromkeys(watched.can_ids, watched.receive))
        if state in (NmtState.PRE_OPERATIONAL, NmtState.OPERATIONAL):
            handlers.update(dict.fromkeys(self._sdo.can_ids, self._on_sdo))
            handlers[self._sync.can_id] = self._sync.receive
            if self.clock.can_id is not None:
                handlers[self.clock.can_id] = self.clock.receive
        if state is NmtState.OPERATIONAL:
            handlers.update(self._rpdos.handlers(self._tpdos.poll))
        return handlers

    def _identify(self, frame: Frame, outgoing: bool) -> Traffic:
        can_id = frame.can_id
        if can_id in (self._sdo.response_ids if outgoing else self._sdo.can_ids):
            return Traffic(Service.SDO, outgoing)
        if can_id == CobId.HEARTBEAT + self.node_id:
            return Traffic(Service.HEARTBEAT if any(frame.data) else Service.BOOT_UP, outgoing)
        engine = self._tpdos if outgoing else self._rpdos
        number = 0 if frame.is_remote else engine.number_of(can_id)
        return Traffic(Service.PDO if number else Service.OTHER, outgoing, number)

    def _refresh(self, now: float) -> None:
        """Update the objects to the values of this time."""
        for drive in self.drives:
            drive.advance(now)
        self._application.refresh(now)

    def _on_remote(self, frame: Frame, now: float) -> None:
        if frame.can_id == CobId.HEARTBEAT + self.node_id:
            self._error_control.guard(now)
            return
        self._tpdos.request(frame.can_id, now)

    def _send_abort(self, abort: sdo.Abort) -> None:
        self._send(Frame(self._sdo.default.response_id, abort.encode()))

    def _on_sdo(self, frame: Frame, now: float) -> None:
        self._refresh(now)
        self._sdo.receive(frame, now)
        self._tpdos.poll(now)

    def _on_sync(self, counter: int, now: float) -> None:
        # inputs are sampled before outputs act, as at the SYNC of a real device
        self._refresh(now)
        self._tpdos.sync(counter, now)
        self._rpdos.sync(now)
        for drive in self.drives:
            drive.sync(now)
        self._tpdos.poll(now)


SIMULATED_SPEED = 0x2000  # of cia406_encoder.eds: how fast the shaft turns in [units/s]
CODE_SEQUENCE = 1  # bit 0 of 0x6000: the position falls when the shaft turns clockwise


class Application:
    """Base of device applications; it does nothing."""

    def refresh(self, now: float) -> None:
        """Update the objects to a steady time in [s]."""

    def connection_lost(self) -> None:
        """React to the loss of the master, or to NMT stop."""


class IoModule(Application):
    """I/O module whose inputs are wired to the outputs of the same number, to show their effect.

    An input without such an output keeps the value that a test writes into its variable.
    """

    def __init__(self, store: ObjectStore) -> None:
        groups = {group.name: group.entries(store.dictionary) for group in IO_GROUPS}
        self._outputs: list[tuple[Variable, Variable | None, Variable | None]] = []
        for kind in ('digital', 'analog'):
            inputs, outputs = groups[f'{kind}_inputs'], groups[f'{kind}_outputs']
            for number, entry in enumerate(outputs):
                output = store.find(*entry.address)
                # error mode and error value
                mode, value = (
                    store.find(index, entry.subindex) if (index, entry.subindex) in store else None
                    for index in ERROR_OBJECTS.get(entry.index, (0, 0))
                )
                self._outputs.append((output, mode, value))
                if number < len(inputs):
                    _wire(output, store.find(*inputs[number].address))

    def connection_lost(self) -> None:
        """Set the outputs to their error values where the error mode selects it."""
        for output, mode, value in self._outputs:
            if not (isinstance(output, Scalar) and isinstance(mode, Scalar)):
                continue
            after = value.value if isinstance(value, Scalar) else 0
            if output.entry.index == DIGITAL_OUTPUTS.indices[0]:  # a bit for each output
                mask = int(mode.value)
                output.value = (int(output.value) & ~mask) | (int(after) & mask)
            elif mode.value:
                output.value = after
            if output.listener is not None:
                output.listener(0.0)


def _wire(output: Variable, place: Variable) -> None:
    def copy(_: float) -> None:
        limits = integer_range(place.entry.data_type)
        if limits is None or not isinstance(output.value, int):
            place.value = output.value
        else:
            place.value = min(max(output.value, limits[0]), limits[1])

    output.listener = copy


class Encoder(Application):
    """An absolute encoder whose shaft turns at the speed of 0x2000."""

    def __init__(self, store: ObjectStore) -> None:
        self._position = store.integer(EncoderObject.POSITION)
        self._speed = store.integer(EncoderObject.SPEED, 1)
        self._range = store.integer(EncoderObject.TOTAL_RANGE, default=1 << 32)
        self._preset = store.integer(EncoderObject.PRESET)
        self._sequence = store.integer(EncoderObject.UNITS_PER_REVOLUTION - 1)
        self._commanded = store.integer(SIMULATED_SPEED)
        self._angle = 0.0  # [units] since the last preset
        self._time: float | None = None
        self._preset.listener = self._set_position

    def refresh(self, now: float) -> None:
        """Turn the shaft."""
        sign = -1 if self._sequence.value & CODE_SEQUENCE else 1
        speed = sign * self._commanded.value
        self._angle += speed * (0.0 if self._time is None else now - self._time)
        self._time = now
        self._speed.put(speed)
        self._position.value = int(self._angle // 1) % max(self._range.value, 1)

    def _set_position(self, now: float) -> None:
        self._angle = float(self._preset.value)
        self.refresh(now)


def make_application(store: ObjectStore) -> Application:
    """Return the application for the device profile in 0x1000."""
    profile = profile_number(store.dictionary)
    if profile == DeviceProfile.GENERIC_IO:
        return IoModule(store)
    return Encoder(store) if profile == DeviceProfile.ENCODER else Application()
