# SPDX-FileCopyrightText: 2026 The arm and quad developers
# SPDX-License-Identifier: Apache-2.0
"""A whole CANopen bus in virtual time: CanopenMaster and simulated devices.

No thread and no waiting: :meth:`VirtualNetwork.run` jumps from one event to the next, so that
minutes pass in milliseconds, and each run of a test is the same. Calls of the master that wait let
time pass, too. Every frame is kept for assertions. Stations may fall silent, frames be lost and
the bus refuse frames on request.
"""

from __future__ import annotations

from collections import deque
from collections.abc import Callable, Coroutine, Iterable, Mapping, Sequence
from concurrent.futures import Future
from dataclasses import dataclass, field
from enum import auto, Enum
from itertools import groupby
import logging
import struct
from typing import Any, Protocol

from drive_samples import bus_config, SCALE

from arm_canopen import (
    AxisFeedback,
    BusConfig,
    BusError,
    CanopenMaster,
    DriveState,
    Event,
    NodeConfig,
    OperationMode,
    Promise,
    Refusal,
    Setpoint,
    Severity,
)
from arm_canopen.master.runner import Clock
from canopen_core.can import Bus, Frame
from canopen_core.can.frame import checked
from canopen_core.standard import (
    Controlword,
    ObjectDictionary,
    POSITION_MODES,
    Statusword,
    TORQUE_MODES,
    VELOCITY_MODES,
)
from canopen_sim import Device, ServoModel
from canopen_sim import Drive as SimulatedDrive

FRAME_TIME = 0.00012  # [s] a frame of 8 bytes at 1 Mbit/s
START = 100.0  # [s] of virtual steady time; not 0, which means "never" in places
BOOT_TIME_MAX = 5.0  # [s]
NEVER = float('inf')
JOINT = 'joint1'  # the drive of tests with one drive
MODES = (*POSITION_MODES, *VELOCITY_MODES, *TORQUE_MODES)


def with_modes(rows: Sequence[Any], *offsets: int) -> list[tuple[Any, OperationMode]]:
    """Return each row with some modes, by default a position, a velocity and a torque mode or so.

    The modes go on from row to row, so that rows of one kind meet all of them.
    """
    steps = offsets or (0, 3, 6)
    return [
        (row, MODES[(number + step) % len(MODES)])
        for number, row in enumerate(rows)
        for step in steps
    ]


class Station(Protocol):
    """What is connected to the bus beside the master."""

    def receive(self, frame: Frame, now: float) -> None:
        """Receive a frame from the bus."""

    def advance(self, now: float) -> None:
        """Do what is due at this time in [s]."""

    def next_deadline(self) -> float | None:
        """Return when something is due in [s], None when nothing is."""


@dataclass(frozen=True)
class Sent:
    """A frame that was on the bus."""

    time: float  # when it was handed to the bus in [s]
    sender: str  # name of the station; ``master`` for the master
    frame: Frame  # the frame


@dataclass
class VirtualWire:
    """Carries one frame at a time, to everybody but its sender."""

    log: list[Sent] = field(default_factory=list)  # every frame, also those that got lost
    loses: Callable[[str, Frame], bool] = lambda sender, frame: False  # whether one gets lost
    alters: Callable[[str, Frame], Frame] = lambda sender, frame: frame  # what arrives of one
    refuses: str = ''  # why the interface of the master takes no frames, empty while it does
    _way: deque[tuple[float, str, Frame]] = field(default_factory=deque)
    _free_at: float = 0.0

    def put(self, now: float, sender: str, frame: Frame) -> None:
        """Send a frame; it arrives when those before it have passed."""
        if self.refuses and sender == 'master':
            raise BusError(self.refuses)
        self.log.append(Sent(now, sender, checked(frame)))
        self._free_at = max(now, self._free_at) + FRAME_TIME
        if not self.loses(sender, frame):
            self._way.append((self._free_at, sender, self.alters(sender, frame)))

    def stall(self, now: float, duration: float) -> None:
        """Keep all frames from now on for a duration in [s], as a gateway or a full CPU does."""
        self._free_at = max(now, self._free_at) + duration

    @property
    def next_arrival(self) -> float:
        """When the next frame arrives in [s]."""
        return self._way[0][0] if self._way else NEVER

    def take(self) -> tuple[str, Frame]:
        """Return the next frame with its time stamp, and its sender."""
        arrival, sender, frame = self._way.popleft()
        return sender, frame._replace(timestamp=arrival)


class _MasterBus(Bus):
    """The end of the bus at the master: waiting for frames lets time pass."""

    def __init__(self, net: VirtualNetwork) -> None:
        super().__init__('virtual')
        self._net = net

    def send(self, frame: Frame) -> None:
        """Send as the master."""
        self._net.wire.put(self._net.now, 'master', frame)

    def receive(self, timeout: float) -> list[Frame]:
        """Go on to the next event, at most so far; return what it brought for the master."""
        return self._net.go_on(self._net.now + timeout)

    def wake(self) -> None:
        """Nothing waits."""

    def close(self) -> None:
        """Nothing is open."""


class _Result(Future[Any]):
    """A result of the master; waiting for it lets time pass."""

    def __init__(self, net: VirtualNetwork) -> None:
        super().__init__()
        self._net = net

    def result(self, timeout: float | None = None) -> Any:
        """Advance the time until it is there."""
        self._net.run_until(self.done, 60.0 if timeout is None else timeout)
        return super().result(0.0)


class _Defects(logging.Handler):
    """Keeps what the thread of the master contains and logs, which fails the test."""

    def __init__(self) -> None:
        super().__init__()
        self.found: list[str] = []
        logging.getLogger('arm_canopen.master.runner').addHandler(self)

    def emit(self, record: logging.LogRecord) -> None:
        """Keep one."""
        self.found.append(f'{record.getMessage()}: {record.exc_info}')


_defects = _Defects()


class VirtualNetwork:
    """A master with its drives, and a simulated device for each node of the configuration.

    Attributes:
        now: Virtual time in [s].
        wire: The bus.
        master: The master.
        devices: The simulated devices that are switched on, by name.
        stations: All that is connected beside the master, by name.
        events: What the master reported.
        allows_defects: Defects of the master are expected, because the test injects them.
        feedback_times: When ``on_feedback`` was called and for which SYNC, in [s].
    """

    def __init__(
        self,
        config: BusConfig,
        *,
        absent: Iterable[str] = (),
        dictionaries: Mapping[str, ObjectDictionary] | None = None,
        servo: ServoModel | None = None,
        rate_units: Mapping[int, tuple[float, float]] | None = None,
        beside_master: bool = False,
    ) -> None:
        """Connect everything and switch the devices on; the master waits for :meth:`start`.

        Args:
            config: The bus.
            absent: Names of devices that are not there (yet).
            dictionaries: What devices really have, where it is not what ``config`` says.
            servo: Time constants of the motors.
            rate_units: Units of velocities and accelerations of every device, as of Device.
            beside_master: Another master is meant to be on the bus, too.
        """
        self.now = START
        self.wire = VirtualWire()
        _defects.found.clear()  # those of other tests
        self.events: list[Event] = []
        self.allows_defects = False
        self.feedback_times: list[tuple[float, float]] = []
        self.stations: dict[str, Station] = {}
        self._due: dict[str, float] = {}
        self.devices: dict[str, Device] = {}
        self._config = config
        self._dictionaries = dict(dictionaries or {})
        self._servo = servo
        self._rate_units = rate_units
        self._beside_master = beside_master
        self.replace_master()
        for node in config.nodes:
            if node.name not in absent:
                self.power_on(node.name)

    def replace_master(self) -> None:
        """Replace the master, which vanishes without a word, by another one."""
        self._running = False
        self.master = CanopenMaster(
            self._config,
            _MasterBus(self),
            on_event=self._note,
            beside_master=self._beside_master,
            clock=Clock(lambda: self.now, lambda: _Result(self)),
        )
        self.network = self.master.network
        self.commands = self.master.commands
        self.drives = {name: each.axis for name, each in self.commands.items()}
        self.network.on_feedback = lambda sync: self.feedback_times.append((self.now, sync))

    def connect(self, name: str, station: Station) -> None:
        """Connect a station of the test's own; it sends with :meth:`send_as`."""
        self.stations[name] = station

    def send_as(self, name: str, frame: Frame) -> None:
        """Send a frame as a station of this name would."""
        self.wire.put(self.now, name, frame)

    def power_on(self, name: str) -> Device:
        """Switch a simulated device on, as new."""
        node = self._config.node(name)
        device = Device(
            node.node_id,
            self._dictionaries.get(name, node.dictionary),
            lambda frame: self.wire.put(self.now, name, frame),
            servo=self._servo,
            rate_units=self._rate_units,
        )
        self.devices[name] = device
        self.connect(name, device)
        device.advance(self.now)
        return device

    def power_off(self, name: str) -> None:
        """Cut the supply of a device."""
        self.stations.pop(name)
        self._due.pop(name, None)
        self.devices.pop(name, None)

    def start(self) -> None:
        """Start the master; its first cycle runs at once."""
        self.master.started = self._running = True
        self.master.thread.refuse_before_start('')
        self.master.thread.begin()

    def run(self, duration: float) -> None:
        """Advance the time by a duration in [s]."""
        end = self.now + duration
        self._look(*self.stations)
        while self._step(end):
            pass

    def run_until(self, condition: Callable[[], bool], timeout: float = BOOT_TIME_MAX) -> float:
        """Advance the time until a condition holds; return how long that took in [s]."""
        begin = self.now
        self._look(*self.stations)
        while not condition():
            assert self._step(begin + timeout), f'not within {timeout:g} s; {self.story()}'
        return self.now - begin

    def boot(self) -> float:
        """Start the master and wait until all devices are booted; returns how long that took."""
        self.start()
        return self.run_until(self.all_ready)

    def all_ready(self) -> bool:
        """Return whether every device is booted and every drive knows its drive's state."""
        online = all(node.online for node in self.network.nodes.values())
        return online and all(drive.view.ready for drive in self.drives.values())

    def simulated(self, name: str = JOINT) -> SimulatedDrive:
        """Return the drive of a simulated device, as it really is."""
        drive = self.devices[name].drive
        assert drive is not None
        return drive

    def motor(self, name: str = JOINT) -> float:
        """Return where a motor really is in [rad]."""
        return self.simulated(name).position / SCALE

    def speed(self, name: str = JOINT) -> float:
        """Return how fast a motor really turns in [rad/s]."""
        return self.simulated(name).velocity / SCALE

    def enable(self, mode: OperationMode, name: str = JOINT) -> None:
        """Enable a drive and select a mode."""
        self.do(name, 'init')
        self.select(name, mode)

    def target(self, target: float, name: str = JOINT) -> None:
        """Command a target of a drive."""
        self.commands[name].set_target(target)

    def home(self, method: int | None = None, name: str = JOINT) -> Promise[str]:
        """Begin to home by a method, or by that of the drive."""
        commands = self.commands[name]
        return commands.run('home', commands.home(method))

    def lose(self, *cob_ids: int) -> None:
        """Lose all frames of these identifiers from now on; by none, no more."""
        self.wire.loses = lambda sender, frame: frame.can_id in cob_ids

    def alter(self, cob_id: int, change: Callable[[bytes], bytes]) -> None:
        """Change the data of all frames of an identifier from now on."""
        before = self.wire.alters

        def alters(sender: str, frame: Frame) -> Frame:
            frame = before(sender, frame)
            return frame._replace(data=change(frame.data)) if frame.can_id == cob_id else frame

        self.wire.alters = alters

    def keep_mode(self, mode: int) -> None:
        """Make the first drive keep a mode of operation, whatever 0x6060 says."""
        word = 0x200 + self._config.nodes[0].node_id
        self.alter(word, lambda data: data[:2] + bytes((mode,)))

    def droop(self, increments: int) -> None:
        """Make the first drive hang so far below its set-points in [inc] while it has power."""
        node = self._config.nodes[0]
        self.wire.alters = lambda sender, frame: frame
        powered = {DriveState.OPERATION_ENABLED, DriveState.QUICK_STOP_ACTIVE}

        def shown(data: bytes) -> bytes:
            position, velocity = struct.unpack('<ii', data)
            hangs = self.simulated(node.name).state in powered
            return struct.pack('<ii', position - increments * hangs, velocity)

        self.alter(0x280 + node.node_id, shown)

    def begin(self, name: str, verb: str, *, preempt: bool = False) -> Promise[str]:
        """Begin a command of a drive by the name of its coroutine, without waiting."""
        commands = self.commands[name]
        part = commands.stops if hasattr(commands.stops, verb) else commands
        sequence: Coroutine[Promise[Any], None, str] = getattr(part, verb)()
        return commands.run(verb, sequence, preempt=preempt)

    def do(self, name: str, verb: str, *, preempt: bool = False, timeout: float = 20.0) -> str:
        """Run a command of a drive to its end; returns its answer or raises its error."""
        return str(self.result(self.begin(name, verb, preempt=preempt), timeout))

    def select(self, name: str, mode: OperationMode, timeout: float = 20.0) -> str:
        """Select a mode of operation; returns the answer or raises the error."""
        commands = self.commands[name]
        return str(self.result(commands.run('select', commands.select_mode(mode)), timeout))

    def result(self, promise: Promise[Any], timeout: float = 20.0) -> Any:
        """Advance the time until a promise is done, and return its result."""
        self.run_until(lambda: promise.done, timeout)
        return promise.result()

    def frames(self, cob_id: int, *, since: float = 0.0) -> list[bytes]:
        """Return the payloads of all frames of an identifier since a time."""
        sent = (each for each in self.wire.log if each.time >= since)
        return [each.frame.data for each in sent if each.frame.can_id == cob_id]

    def controlwords(self, name: str, *, since: float = 0.0) -> list[int]:
        """Return the controlwords that the master sent to a drive, without repetitions."""
        frames = self.frames(self._config.node(name).rpdos[0].cob_id, since=since)
        return [word for word, _ in groupby(struct.unpack_from('<H', data)[0] for data in frames)]

    def targets(self, name: str, *, since: float = 0.0) -> list[int]:
        """Return all values of 0x607A that the master sent to a drive in [inc]."""
        frames = self.frames(self._config.node(name).rpdos[1].cob_id, since=since)
        return [struct.unpack_from('<i', data)[0] for data in frames]

    def reported(self, severity: Severity = Severity.INFO) -> list[str]:
        """Return what the master reported, of this severity and above."""
        return [str(event) for event in self.events if event.severity >= severity]

    def story(self) -> str:
        """Return what was reported so far, for messages of failed tests."""
        return '; '.join(self.reported()) or 'nothing was reported'

    def go_on(self, end: float) -> list[Frame]:
        """Go on to the next event of bus and stations; return what arrives at the master."""
        time = min(self.wire.next_arrival, min(self._due.values(), default=NEVER), end)
        self.now = max(self.now, time)
        late = [name for name, deadline in self._due.items() if deadline <= self.now]
        received = []
        while self.wire.next_arrival <= self.now:
            sender, frame = self.wire.take()
            if sender != 'master':
                received.append(frame)
            self._deliver(sender, frame)
        for name in late:  # what the frames have made due is the next event
            if name in self.stations:
                _contain(self.stations[name].advance, self.now)
                self._look(name)
        return received

    def _note(self, event: Event) -> None:
        self.events.append(event)
        if not self.allows_defects and 'a defect in the CANopen master' in event.text:
            _defects.found.append(event.text)

    def _step(self, end: float) -> bool:
        """Go on to the next event; returns False when there is none until ``end``."""
        thread = self.master.thread
        time = min(self.wire.next_arrival, min(self._due.values(), default=NEVER))
        if self._running:
            time = min(time, thread.next_due)
        if time > end:
            self.now = end
            return False
        if self._running:
            thread.step()
        else:
            self.go_on(time)
        found, _defects.found = _defects.found, []
        assert not found, found
        return True

    def _deliver(self, sender: str, frame: Frame) -> None:
        for name, station in list(self.stations.items()):
            if name == sender or (isinstance(station, Device) and _ignores(station, frame)):
                continue
            _contain(station.receive, frame, self.now)
            self._look(name)

    def _look(self, *names: str) -> None:
        """Keep when stations have something to do; only what happens to them changes it."""
        for name in names:
            deadline = self.stations[name].next_deadline()
            self._due[name] = NEVER if deadline is None else deadline


class Leader:
    """A motion source that leads its axes while they follow, or does what a test wants."""

    def __init__(
        self,
        *axes: str,
        speed: float = 1.0,
        feed_forward: tuple[float, float] = (0.0, 0.0),
        heeds: bool = True,
    ) -> None:
        """Lead ``axes``, the first drive by default.

        Args:
            *axes: Names of drives.
            speed: Of each axis, in user units.
            feed_forward: Velocity and effort that it announces.
            heeds: It leads an axis only while that is followable.
        """
        self.axes = axes or (JOINT,)  # names of its axes
        self.losses: dict[str, Refusal] = {}  # the first refusal of each axis that it has lost
        self.pauses = False  # it answers nothing
        self._speed = speed
        self._feed_forward = feed_forward
        self._heeds = heeds
        self._positions: dict[str, float] = {}

    def update(
        self, now: float, period: float, feedback: Sequence[AxisFeedback]
    ) -> Sequence[Setpoint | None]:
        """Go on from the set-point at which it began."""
        return [self._lead(axis, period) for axis in feedback]

    def _lead(self, axis: AxisFeedback, period: float) -> Setpoint | None:
        if self.pauses or (self._heeds and not axis.followable):
            return None
        before = self._positions.get(axis.name, axis.setpoint)
        self._positions[axis.name] = before + self._speed * period
        return Setpoint(self._positions[axis.name], *self._feed_forward)

    def released(self, axis: str, refusal: Refusal) -> None:
        """Keep the cause."""
        self.losses.setdefault(axis, refusal)


class SetPointKind(Enum):
    """When a drive sees the edge of bit 4, and whether it raises bit 12."""

    ALWAYS = auto()
    NEVER = auto()
    NEVER_ACKNOWLEDGES = auto()
    UNLESS_FULL = auto()  # an edge that came while bit 12 was set is lost for good
    AFTER_HALT = auto()  # bit 4 counts as 0 while bit 8 is set
    EDGE_AFTER_HALT = auto()  # an edge that came under halt is lost for good
    WORD_AFTER_HALT = auto()  # so is one in the word that ends the halt


STATUSWORD_READ = b'\x4b\x41\x60\x00'  # answer with 0x6041 by SDO


class SetPoints:
    """Makes another kind of drive, in mode 1, of the first one, which takes set-points always."""

    def __init__(self, net: VirtualNetwork, kind: SetPointKind) -> None:
        self._kind = kind
        node_id = net.network.config.nodes[0].node_id
        self._status, self._command = 0x180 + node_id, 0x200 + node_id
        self._answer = 0x580 + node_id
        self._offered = self._lost = self._halted = False
        self._full = True
        net.wire.alters = self

    def __call__(self, sender: str, frame: Frame) -> Frame:
        """Take out bit 4 where it is not seen, or bit 12."""
        data = bytearray(frame.data)
        if frame.can_id == self._answer and data[:4] == STATUSWORD_READ:
            if self._kind is SetPointKind.NEVER_ACKNOWLEDGES:
                data[5] &= ~(Statusword.SET_POINT_ACKNOWLEDGE >> 8)
            return frame._replace(data=bytes(data))
        if frame.can_id not in (self._status, self._command):
            return frame
        positions = data[2:3] == bytes((OperationMode.PROFILE_POSITION,))
        if frame.can_id == self._status:
            self._full = bool(data[1] & Statusword.SET_POINT_ACKNOWLEDGE >> 8)
            if positions and self._kind is SetPointKind.NEVER_ACKNOWLEDGES:
                data[1] &= ~(Statusword.SET_POINT_ACKNOWLEDGE >> 8)
        elif self._is_lost(int.from_bytes(data[:2], 'little')) and positions:
            data[0] &= ~int(Controlword.NEW_SET_POINT)
        return frame._replace(data=bytes(data))

    def _is_lost(self, word: int) -> bool:
        before, self._halted = self._halted, bool(word & Controlword.HALT)
        offered = bool(word & Controlword.NEW_SET_POINT)
        rising, self._offered = offered and not self._offered, offered
        blind = {
            SetPointKind.NEVER: True,
            SetPointKind.UNLESS_FULL: self._full,
            SetPointKind.EDGE_AFTER_HALT: self._halted,
            SetPointKind.WORD_AFTER_HALT: self._halted or before,
        }.get(self._kind, False)
        self._lost = offered and (self._lost or (rising and blind))
        return self._lost or (self._kind is SetPointKind.AFTER_HALT and self._halted)


def booted(*nodes: NodeConfig, **master: Any) -> VirtualNetwork:
    """Return a booted network of devices; the keywords are fields of MasterConfig."""
    net = VirtualNetwork(bus_config(*nodes, **master))
    net.boot()
    return net


def _contain(call: Callable[..., None], *arguments: Any) -> None:
    """Note a defect of a station, which the master would take for one of its bus."""
    try:
        call(*arguments)
    except Exception as error:  # noqa: BLE001
        _defects.found.append(f'a station fails: {error!r}')


def _ignores(device: Device, frame: Frame) -> bool:
    return frame.can_id not in device.handlers and not frame.is_remote
