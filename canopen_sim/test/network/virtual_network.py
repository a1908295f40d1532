# SPDX-FileCopyrightText: 2026 The arm and quad developers
# SPDX-License-Identifier: Apache-2.0
"""A whole CANopen network in virtual time: the master, its drives and simulated devices.

No thread, no clock, no waiting: :meth:`VirtualNetwork.run` jumps from one event to the next, so
that minutes pass in milliseconds, and each run of a test is the same. Every frame is kept for
assertions. Stations may fall silent, frames be lost and the bus refuse frames on request.
"""

from __future__ import annotations

from collections import deque
from collections.abc import Callable, Coroutine, Iterable, Mapping
from dataclasses import dataclass, field
import struct
from typing import Any, Protocol

from arm_canopen import BusError, Event, OperationMode, Severity
from arm_canopen.can import Frame
from arm_canopen.can.frame import checked
from arm_canopen.cia402.drive import Drive
from arm_canopen.cia402.drive_commands import DriveCommands
from arm_canopen.cia402.motion_group import MotionGroup
from arm_canopen.config import BusConfig
from arm_canopen.master.network import Network
from arm_canopen.master.scheduler import Promise
from arm_canopen.standard import ObjectDictionary
from canopen_sim import Device, ServoModel
from canopen_sim.drive.rate import INCREMENTS_PER_SECOND, RateUnits

FRAME_TIME = 0.00012  # [s] a frame of 8 bytes at 1 Mbit/s
START = 100.0  # [s] of virtual steady time; not 0, which means "never" in places
BOOT_TIME_MAX = 5.0  # [s]
NEVER = float('inf')


class Station(Protocol):
    """What is connected to the bus beside the master."""

    def receive(self, frame: Frame, now: float) -> None:
        """Take a frame from the bus."""

    def advance(self, now: float) -> None:
        """Do what is due at this time in [s]."""

    def next_deadline(self) -> float | None:
        """Return when something is due in [s], None when nothing is."""


@dataclass(frozen=True)
class Sent:
    """A frame that was on the bus.

    Attributes:
        time: When it was handed to the bus in [s].
        sender: Name of the station; ``master`` for the master.
        frame: The frame.
    """

    time: float
    sender: str
    frame: Frame


@dataclass
class VirtualWire:
    """Carries one frame at a time, to everybody but its sender.

    Attributes:
        log: Every frame that was sent, also those that got lost.
        loses: Returns of a frame and its sender whether it gets lost.
        alters: Gives what arrives of a frame of a sender.
        refuses: Why the interface of the master takes no frames, empty while it does.
    """

    log: list[Sent] = field(default_factory=list)
    loses: Callable[[str, Frame], bool] = lambda sender, frame: False
    alters: Callable[[str, Frame], Frame] = lambda sender, frame: frame
    refuses: str = ''
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

    @property
    def next_arrival(self) -> float:
        """When the next frame arrives in [s]."""
        return self._way[0][0] if self._way else NEVER

    def take(self) -> tuple[str, Frame]:
        """Return the next frame with its time stamp, and its sender."""
        arrival, sender, frame = self._way.popleft()
        return sender, frame._replace(timestamp=arrival)


class VirtualNetwork:
    """A master with its drives, and a simulated device for each node of the configuration.

    Attributes:
        now: Virtual time in [s].
        wire: The bus.
        network: The master.
        group: Its drives and motion sources.
        drives: Its drives by name.
        commands: Their commands by name.
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
        rate_units: RateUnits = INCREMENTS_PER_SECOND,
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
        """Let the master vanish without a word, and another one take its place."""
        self._cycle_at = NEVER
        self.network = Network(
            self._config,
            lambda frame: self.wire.put(self.now, 'master', frame),
            self._note,
            beside_master=self._beside_master,
        )
        scheduler = self.network.scheduler
        drives = [
            Drive(node, scheduler, axis)
            for node in self.network.nodes.values()
            if node.config.is_drive
            for axis in node.config.axes
        ]
        self.drives = {drive.name: drive for drive in drives}
        self.commands = {drive.name: DriveCommands(drive, scheduler) for drive in drives}
        self.group = MotionGroup(drives, self._note)
        self.network.on_cycle = self.group.cycle
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
        self.network.start(self.now)
        self._cycle_at = self.now

    def run(self, duration: float) -> None:
        """Let time pass in [s]."""
        end = self.now + duration
        self._look(*self.stations)
        while self._step(end):
            pass

    def run_until(self, condition: Callable[[], bool], timeout: float = BOOT_TIME_MAX) -> float:
        """Let time pass until a condition holds; returns how long that took in [s]."""
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
        """Let time pass until a promise is done, and return its result."""
        self.run_until(lambda: promise.done, timeout)
        return promise.result()

    def frames(self, cob_id: int, *, since: float = 0.0) -> list[bytes]:
        """Return the payloads of all frames of an identifier since a time."""
        return [
            sent.frame.data
            for sent in self.wire.log
            if sent.frame.can_id == cob_id and sent.time >= since
        ]

    def controlwords(self, name: str, *, since: float = 0.0) -> list[int]:
        """Return the controlwords that the master sent to a drive, without repetitions."""
        words = [
            struct.unpack_from('<H', data)[0]
            for data in self.frames(self._config.node(name).rpdos[0].cob_id, since=since)
        ]
        return [word for n, word in enumerate(words) if n == 0 or word != words[n - 1]]

    def targets(self, name: str, *, since: float = 0.0) -> list[int]:
        """Return all values of 0x607A that the master sent to a drive in [inc]."""
        return [
            struct.unpack_from('<i', data)[0]
            for data in self.frames(self._config.node(name).rpdos[1].cob_id, since=since)
        ]

    def reported(self, severity: Severity = Severity.INFO) -> list[str]:
        """Return what the master reported, of this severity and above."""
        return [str(event) for event in self.events if event.severity >= severity]

    def story(self) -> str:
        """Say what was reported so far, for messages of failed tests."""
        return '; '.join(self.reported()) or 'nothing was reported'

    def _note(self, event: Event) -> None:
        self.events.append(event)
        if not self.allows_defects:
            assert 'a defect in the CANopen master' not in event.text, event.text

    def _step(self, end: float) -> bool:
        """Go on to the next event; returns False when there is none until ``end``."""
        due = min(self._due.values(), default=NEVER)
        time = min(self.wire.next_arrival, self._cycle_at, due)
        deadline = self.network.scheduler.next_deadline()
        if deadline is not None:
            time = min(time, deadline)
        if self._cycle_at < NEVER:
            time = min(time, self.network.next_update)
        if time > end:
            self.now = end
            return False
        self.now = max(self.now, time)
        late = [name for name, deadline in self._due.items() if deadline <= self.now]
        while self.wire.next_arrival <= self.now:
            self._deliver(*self.wire.take())
        for name in late:  # what the frames have made due is the next event
            if name in self.stations:
                self.stations[name].advance(self.now)
                self._look(name)
        if self._cycle_at < NEVER:
            self._serve_master()
        return True

    def _serve_master(self) -> None:
        period = self._config.master.cycle_period
        if self._cycle_at <= self.now:
            self.network.sync()
            self.network.cycle(self.now, period)
            self._cycle_at += period
        self.network.advance(self.now)
        if self.network.next_update <= self.now:
            self.network.update(self.now, period)

    def _deliver(self, sender: str, frame: Frame) -> None:
        if sender != 'master' and self._cycle_at < NEVER:
            self.network.receive(frame)
        for name, station in list(self.stations.items()):
            if name == sender or (isinstance(station, Device) and _ignores(station, frame)):
                continue
            station.receive(frame, self.now)
            self._look(name)

    def _look(self, *names: str) -> None:
        """Keep when stations have something to do; only what happens to them changes it."""
        for name in names:
            deadline = self.stations[name].next_deadline()
            self._due[name] = NEVER if deadline is None else deadline


def _ignores(device: Device, frame: Frame) -> bool:
    return frame.can_id not in device.handlers and not frame.is_remote
