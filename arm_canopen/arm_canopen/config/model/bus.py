# SPDX-FileCopyrightText: 2026 The arm and quad developers
# SPDX-License-Identifier: Apache-2.0
"""The typed model of a bus: bus.yml and the EDS files, checked and in SI units.

A TPDO that is sent only on change is silent when nothing changes, and also when it gets lost. An
event timer (CiA 301, 7.5.2.37) makes it periodic, so the master sets one if the device has it.
"""

from __future__ import annotations

from collections.abc import Callable, Iterator, Mapping
from dataclasses import dataclass, field, replace
import math
from pathlib import Path

from canopen_core import CodecError, Place, Problem
from canopen_core.standard import (
    AXIS_OFFSET,
    BIT_RATES_KBIT,
    CAN_ID_MASK,
    COB_ID_INVALID,
    CobId,
    COMMANDS,
    DataType,
    decode,
    EVENT_DRIVEN,
    Index,
    is_state,
    MappedObject,
    object_address,
    ObjectDictionary,
    ObjectEntry,
    PDO_COUNT_MAX,
    rpdo_default,
    slow_timeout,
    SYNCHRONOUS_MAX,
    tpdo_default,
    Value,
)

from ..keys import HUNDRED_MICROSECONDS, key, KILOBIT, Kind, MICROSECONDS, MILLISECONDS, Use
from .drive import DriveConfig

PERIODS_MISSED = 3  # periods of a TPDO, or of a poll, without a new value
STALE_AFTER = 0.5  # [s] shortest time without a new value after which a TPDO is stale
EVENT_TIME_MAX = 0.1  # [s] longest event timer set by default
INHIBIT_FACTOR = 2.0  # shortest event timer, in inhibit times
INHIBIT_TIME_SUBINDEX = 3  # of the communication parameter
EVENT_TIMER_SUBINDEX = 5


@dataclass(frozen=True, slots=True)
class Direction:
    """A PDO direction (TPDO or RPDO), seen from the device."""

    name: str  # key in bus.yml
    communication: int  # index of the first communication parameter
    mapping: int  # index of the first mapping parameter
    # pre-defined COB-ID of PDO 1 to 4 by number and node id
    default_cob_id: Callable[[int, int], int]
    mappable: Callable[[ObjectEntry], bool]  # whether an object may be mapped in this direction

    @property
    def title(self) -> str:
        """Name as people write it."""
        return self.name.upper()

    def numbers(self, dictionary: ObjectDictionary) -> list[int]:
        """Return the PDO numbers of a device in ascending order."""
        first = self.communication
        indices = {entry.index for entry in dictionary}
        return sorted(
            index - first + 1 for index in indices if first <= index < first + PDO_COUNT_MAX
        )


TPDO = Direction(
    'tpdo',
    Index.TPDO_COMMUNICATION,
    Index.TPDO_MAPPING,
    tpdo_default,
    lambda entry: entry.tpdo_mappable,
)
RPDO = Direction(
    'rpdo',
    Index.RPDO_COMMUNICATION,
    Index.RPDO_MAPPING,
    rpdo_default,
    lambda entry: entry.rpdo_mappable,
)


@dataclass(frozen=True, slots=True)
class PdoConfig:
    """One PDO of a device, named from the device's side."""

    direction: Direction
    number: int  # 1 for the objects 0x1400/0x1600 or 0x1800/0x1A00, and so on
    enabled: bool  # the PDO exists (bit 31 of its COB-ID is clear)
    cob_id: int  # its 11-bit CAN identifier; 0 when it is disabled and has none
    transmission: int  # transmission type 0 to 255 (CiA 301, tables 69 and 71)
    # shortest time between two transmissions in [s]; None leaves the device's
    inhibit_time: float | None = None
    # event timer of a TPDO, deadline of an RPDO in [s]; None leaves the device's
    event_time: float | None = None
    # SYNC counter value at which it starts; None leaves the device's
    sync_start: int | None = None
    mapping: tuple[MappedObject, ...] = ()
    configured: bool = False  # bus.yml names this PDO, so the master writes it at boot
    fixed_mapping: bool = False  # the mapping in the device is read-only and equals ``mapping``
    # the EDS states the COB-ID of another node id; ``cob_id`` is the one for this node id
    assumed: bool = False
    # place of its COB-ID in bus.yml, else of the PDO or the device
    place: Place = field(default=Place(), compare=False)

    @property
    def title(self) -> str:
        """Name as people write it, such as ``TPDO 1``."""
        return f'{self.direction.title} {self.number}'

    @property
    def key(self) -> str:
        """Key in bus.yml, such as ``tpdo.1``."""
        return f'{self.direction.name}.{self.number}'

    @property
    def communication(self) -> int:
        """Index of its communication parameter."""
        return self.direction.communication + self.number - 1

    @property
    def mapping_index(self) -> int:
        """Index of its mapping parameter."""
        return self.direction.mapping + self.number - 1


def with_event_timer(pdo: PdoConfig, dictionary: ObjectDictionary) -> PdoConfig:
    """Return the PDO, with an event timer added if it carries drive state and needs one."""
    index = pdo.communication
    entry = dictionary.get(index, EVENT_TIMER_SUBINDEX)
    chosen = pdo.event_time is not None or pdo.transmission < EVENT_DRIVEN
    if chosen or not _carries_state(pdo) or entry is None or not entry.access.writable:
        return pdo
    default = (dictionary.number(index, EVENT_TIMER_SUBINDEX) or 0) / MILLISECONDS
    inhibit = pdo.inhibit_time
    if inhibit is None:
        inhibit = (dictionary.number(index, INHIBIT_TIME_SUBINDEX) or 0) / HUNDRED_MICROSECONDS
    time = min(default or EVENT_TIME_MAX, EVENT_TIME_MAX)
    return replace(pdo, event_time=max(time, INHIBIT_FACTOR * inhibit))


def longest_silence(pdo: PdoConfig, sync_period: float) -> float:
    """Return the time in [s] after which a TPDO counts as lost; infinite if it may stay silent.

    ``sync_period`` is in [s], 0 if this master sends no SYNC.
    """
    if 1 <= pdo.transmission <= SYNCHRONOUS_MAX and sync_period > 0.0:
        return max(STALE_AFTER, PERIODS_MISSED * pdo.transmission * sync_period)
    if pdo.transmission >= EVENT_DRIVEN and pdo.event_time:
        return PERIODS_MISSED * pdo.event_time
    return math.inf


def loss_unnoticed(pdo: PdoConfig, silence: float) -> bool:
    """Return whether a lost TPDO with drive state goes unnoticed; ``silence`` is in [s]."""
    return silence == math.inf and _carries_state(pdo)


def _carries_state(pdo: PdoConfig) -> bool:
    return pdo.enabled and any(is_state(mapped.index) for mapped in pdo.mapping)


U16_MAX, U32_MAX = 0xFFFF, 0xFFFF_FFFF
BITRATES = dict.fromkeys(BIT_RATES_KBIT, 'kbit/s')


@dataclass(frozen=True, slots=True)
class Identity:
    """Expected identity of a device (0x1000 and 0x1018); a value of 0 is not checked."""

    device_type: int = 0
    vendor_id: int = 0
    product_code: int = 0
    revision_number: int = 0
    serial_number: int = 0

    @property
    def objects(self) -> Iterator[tuple[str, int, int, int]]:
        """Yield attribute, index, sub-index and value of each object to check."""
        for attribute, index, subindex in IDENTITY_OBJECTS:
            value = getattr(self, attribute)
            if value:
                yield attribute, index, subindex, value


IDENTITY_OBJECTS = (
    ('device_type', Index.DEVICE_TYPE, 0),
    ('vendor_id', Index.IDENTITY, 1),
    ('product_code', Index.IDENTITY, 2),
    ('revision_number', Index.IDENTITY, 3),
    ('serial_number', Index.IDENTITY, 4),
)
ANY_DEVICE = Identity()


POLL_PERIOD = 0.01  # [s]
CYCLE_PERIOD = 0.01  # [s] used without SYNC if no device sets a ``period``


@dataclass(frozen=True, slots=True)
class MasterConfig:
    """The master's own settings; each key of bus.yml fills its field, times in [s]."""

    node_id: int
    name: str = 'master'  # key in bus.yml; also the name of its ROS node
    driver: str = 'ros2_canopen::MasterDriver'  # driver class as bus.yml names it
    namespace: str = ''  # ROS namespace, empty for none
    remappings: dict[str, str] = field(default_factory=dict)  # ROS remappings, from name to name
    bitrate: int = key(
        1_000_000,
        'bit rate, for the bus load; the interface is set up outside',
        unit=KILOBIT,
        name='baudrate',
        choices=BITRATES,
    )
    heartbeat_producer: float = key(
        0.2,
        "period of the master's heartbeat, 0 for none",
        (0, U16_MAX),
        unit=MILLISECONDS,
        why='by default not 0, as only this stops drives when the master dies; write 0 for none',
    )
    sync_period: float = key(
        0.0,
        'period of SYNC, which is the cycle; 0 for none',
        (500, 60_000_000),
        unit=MICROSECONDS,
        zero=True,
        why='the unit is microseconds, 10 ms is 10000',
    )
    sync_window: float = key(
        0.0,
        'time after SYNC in which TPDOs should answer; later ones are counted',
        (0, U32_MAX),
        unit=MICROSECONDS,
        kind=Kind.INTEGER,
    )
    sync_overflow: int = key(0, 'highest counter in SYNC, 0 for none', (2, 240), zero=True)
    time_cob_id: int = key(
        0x100,
        'COB-ID of TIME; bit 30 has the master send it, each second by default',
        (0, U32_MAX),
    )
    emcy_inhibit_time: float = key(
        0.0,
        'for `canopen dcf` only: the master sends no EMCY',
        (0, U16_MAX),
        unit=HUNDRED_MICROSECONDS,
        kind=Kind.INTEGER,
        use=Use.UNUSED,
        why='the master sends no EMCY',
    )
    nmt_inhibit_time: float = key(
        0.0,
        'shortest time between two NMT commands',
        (0, U16_MAX),
        unit=HUNDRED_MICROSECONDS,
        kind=Kind.INTEGER,
    )
    start: bool = key(True, 'false: SYNC and RPDOs wait for NMT start to the id of the master')
    start_nodes: bool = key(True, 'the master starts each device when it is configured')
    start_all_nodes: bool = key(
        False, 'the first start is one frame to all, when all are configured'
    )
    reset_all_nodes: bool = key(False, 'the loss of a mandatory device resets all devices')
    stop_all_nodes: bool = key(False, 'the loss of a mandatory device stops all devices')
    boot_time: float = key(
        0.0,
        'time after which missing mandatory devices are reported, 0 for never',
        (0, U32_MAX),
        unit=MILLISECONDS,
        kind=Kind.INTEGER,
    )
    boot_timeout: float = key(
        2.0, 'time-out of each SDO of the boot', (1, 60_000), unit=MILLISECONDS
    )
    time_period: float = 0.0  # period of TIME in [s]; 0 sends none
    # period of the control cycle in [s]: the SYNC period, or without SYNC the shortest ``period``
    # of a device
    cycle_period: float = CYCLE_PERIOD
    # heartbeat consumer time in [s] for devices that watch the master (0x1016); 0 if it sends no
    # heartbeat
    heartbeat_timeout: float = 0.0
    # 0x1029 of the master by sub-index: its reaction to the loss of a device
    error_behavior: dict[int, int] = field(default_factory=dict)
    identity: Identity = ANY_DEVICE  # 0x1018 of the master, for the files of other tools

    @property
    def is_lifecycle(self) -> bool:
        """Whether the master and its devices are lifecycle nodes."""
        return 'Lifecycle' in self.driver


RETRY_FACTOR = 3


@dataclass(frozen=True, slots=True)
class SdoWrite:
    """An object that the master writes at boot."""

    index: int
    subindex: int
    data: bytes  # value, encoded for SDO
    # time-out of this write in [s]; None for the usual one
    timeout: float | None = None
    place: Place = field(default=Place(), compare=False)  # place in bus.yml


@dataclass(frozen=True, slots=True)
class NodeConfig:
    """A device of the bus."""

    name: str  # key in bus.yml; also the name of its ROS node
    node_id: int
    driver: str  # as bus.yml names it, e.g. ``ros2_canopen::Cia402Driver``
    eds: Path
    dictionary: ObjectDictionary  # its objects, defaults resolved for this node id
    namespace: str = ''  # ROS namespace, empty for none
    remappings: dict[str, str] = field(default_factory=dict)  # ROS remappings, from name to name
    identity: Identity = ANY_DEVICE
    # heartbeat period of the device in [s], from bus.yml or else the EDS; 0 for none
    heartbeat_producer: float = 0.0
    # heartbeat consumer time of the master in [s]; 0 for no supervision
    heartbeat_timeout: float = 0.0
    # the device watches the heartbeat of the master (the device has 0x1016, the master sends one)
    heartbeat_consumer: bool = False
    guard_time: float = 0.0  # period of node guarding in [s]; 0 for none
    life_time_factor: int = 0  # guard times without a message until either side counts as lost
    retry_factor: int = RETRY_FACTOR  # missed answers after which a guarded device counts as lost
    boot: bool = key(
        True,
        'false: the device is taken as it is, neither reset nor configured nor started',
    )
    mandatory: bool = key(False, 'no device is started before this one is configured')
    reset_communication: bool = key(
        True,
        'false: a device that is in operation is taken over without a reset; it must not '
        'watch the master, so write `heartbeat_consumer: false`, too: else it stops by '
        'itself while no master is there',
    )
    restore_configuration: int = key(
        0,
        'sub-index of 0x1011 by which defaults are restored before the boot',
        (0, 127),
    )
    sdo_timeout: float = key(
        0.2,
        'time-out of each SDO after the boot',
        (1, 60_000),
        unit=MILLISECONDS,
        name='sdo_timeout_ms',
    )
    boot_timeout: float = key(
        1.0,
        'how long one attempt to find the device takes',
        (1, 600_000),
        unit=MILLISECONDS,
        name='boot_timeout_ms',
    )
    poll_period: float = key(
        POLL_PERIOD,
        'how often objects that no PDO carries are read; without SYNC the cycle, too',
        (1, 60_000),
        unit=MILLISECONDS,
        name='period',
    )
    tpdos: tuple[PdoConfig, ...] = ()  # all TPDOs of the device, by ascending number
    rpdos: tuple[PdoConfig, ...] = ()  # all RPDOs of the device, by ascending number
    # ``time_cob_id``, ``error_behavior`` and the list ``sdo`` of bus.yml, in the order of writing
    sdo_writes: tuple[SdoWrite, ...] = ()
    # ParameterValues of its DCF that differ from the defaults; they are written first
    parameter_writes: tuple[SdoWrite, ...] = ()
    # the axes of a CiA 402 drive, by ascending channel
    axes: tuple[DriveConfig, ...] = (DriveConfig(),)
    line: int = 0  # line of bus.yml at which the node begins

    def write_of(self, index: int, subindex: int) -> SdoWrite | None:
        """Return the last write of an object in bus.yml, or None."""
        for write in reversed(self.sdo_writes):
            if (write.index, write.subindex) == (index, subindex):
                return write
        return None

    @property
    def emergency_id(self) -> int | None:
        """COB-ID of its EMCY messages (CiA 301, 7.5.2.17); None if EMCY is disabled."""
        value = self.value_after_boot(Index.EMCY_COB_ID, data_type=DataType.UNSIGNED32)
        if not isinstance(value, int):
            return CobId.EMCY + self.node_id
        return None if value & COB_ID_INVALID else value & CAN_ID_MASK

    def write_timeout(self, index: int, subindex: int, usual: float | None = None) -> float:
        """Return the time-out of a write in [s]; ``usual`` replaces sdo_timeout as its default."""
        write = self.write_of(index, subindex)
        if write is not None and write.timeout is not None:
            return write.timeout
        return slow_timeout(index, self.sdo_timeout if usual is None else usual)

    def value_after_boot(
        self, index: int, subindex: int = 0, data_type: DataType | None = None
    ) -> Value | None:
        """Return the value of an object after boot, by the files; None if no file defines it.

        ``data_type`` decodes an object that the EDS lacks.

        Raises:
            CodecError: The value written at boot does not fit the type of the object.
        """
        entry = self.dictionary.get(index, subindex)
        write = self.write_of(index, subindex)
        known_type = entry.data_type if entry is not None else data_type
        if write is not None and known_type is not None:
            try:
                return decode(known_type, write.data)
            except CodecError as error:
                place = object_address(index, subindex)
                raise CodecError(f'{self.name}: the write of {place} at boot: {error}') from None
        return None if entry is None else entry.default

    @property
    def pdos(self) -> tuple[PdoConfig, ...]:
        """All PDOs, the TPDOs first."""
        return self.tpdos + self.rpdos

    @property
    def uses_node_guarding(self) -> bool:
        """Whether the master uses node guarding; never together with a heartbeat (CiA 301)."""
        return self.guard_time > 0.0 and not self.heartbeat_producer

    @property
    def life_guarding(self) -> bool:
        """Whether the device supervises the guarding requests of the master (life guarding)."""
        return self.uses_node_guarding and self.life_time_factor > 0

    @property
    def drive(self) -> DriveConfig:
        """The first axis, which is the only one of most drives."""
        return self.axes[0]

    @property
    def is_lifecycle(self) -> bool:
        """Whether its ROS node is a lifecycle node."""
        return 'Lifecycle' in self.driver

    @property
    def commanded_indices(self) -> frozenset[int]:
        """Indices of the objects that its driver writes in each cycle."""
        if not self.is_drive:
            return frozenset()
        return frozenset(
            index + AXIS_OFFSET * axis.channel for axis in self.axes for index in COMMANDS
        )

    @property
    def is_drive(self) -> bool:
        """Whether the device uses the CiA 402 driver."""
        return 'Cia402' in self.driver

    @property
    def joints(self) -> tuple[str, ...]:
        """Names of its joints: its own name, or those of its channels."""
        return tuple(axis.name for axis in self.axes) if self.is_drive else ()


@dataclass(frozen=True, slots=True)
class BusConfig:
    """A bus: its master, devices and warnings."""

    file: Path  # the bus.yml that it was read from
    master: MasterConfig
    nodes: tuple[NodeConfig, ...]  # the devices in the order of the file
    warnings: tuple[Problem, ...] = ()  # oddities in the file that prevent nothing
    # place of each key in the file, by its key path: ``('master', 'node_id')``, ``('joint1',
    # 'tpdo', '1', 'mapping')``; keys of ``defaults`` are listed for every device
    locations: Mapping[tuple[str, ...], Place] = field(default_factory=dict, compare=False)

    @property
    def joints(self) -> tuple[str, ...]:
        """Names of all joints of its drives, in the order of the file."""
        return tuple(joint for node in self.nodes for joint in node.joints)

    def place_of(self, *names: str) -> Place:
        """Return the place of a key, or of the nearest enclosing key that the file has."""
        for length in range(len(names), 0, -1):
            if (place := self.locations.get(names[:length])) is not None:
                return place
        return Place(self.file)

    def node(self, name: str) -> NodeConfig:
        """Return a device by name.

        Raises:
            KeyError: No such device; the message lists those that exist.
        """
        for node in self.nodes:
            if node.name == name:
                return node
        names = ', '.join(node.name for node in self.nodes)
        raise KeyError(f'no device {name!r} in {self.file}; it has: {names}')
