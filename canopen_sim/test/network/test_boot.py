# SPDX-FileCopyrightText: 2026 The arm and quad developers
# SPDX-License-Identifier: Apache-2.0
"""Booting devices: identity, configuration, refusals, mishaps, and the rules of CiA 302-2.

Devices that are kept alive, left alone, restored or waited for; and such that fall back.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace
from functools import partial
import itertools
import struct
from typing import Any

from bus_rig import booted, VirtualNetwork
from drive_samples import bus_config, drive_config, pdo, sdo_write
from hypothesis import example, given, settings
from hypothesis import strategies as st
import pytest
from scripted_device import (
    object_bytes,
    PRE_OPERATIONAL,
    RESET_COMMUNICATION,
    RESET_NODE,
    ScriptedDevice,
    START,
    STOP,
)

from arm_canopen import CanopenError, EventKind, NodeConfig, Severity
from arm_canopen.config import Identity
from arm_canopen.master.remote_node import (
    BootPhase,
    LONGEST_PAUSE,
    node_status,
    RemoteNode,
    STABLE_TIME,
)
from canopen_core import Place
from canopen_core.can import Frame
from canopen_core.standard import AccessType, NmtCommand, NmtState, ObjectDictionary

NODE = 'io'
NODE_ID = 9
INVALID = 0x8000_0000
ABORT = 0x80  # command specifier of an SDO abort
IDENTITY = Identity(
    device_type=0x0002_0192,
    vendor_id=0x555,
    product_code=7,
    revision_number=0x1_0001,
    serial_number=0x1234,
)

NUMBERS = ('vendor_id', 'product_code', 'revision_number', 'serial_number')
IDENTITY_PLACES = {
    'device_type': (0x1000, 0),
    **{name: (0x1018, subindex) for subindex, name in enumerate(NUMBERS, 1)},
}
DEVICE_VALUES = {
    **{place: getattr(IDENTITY, name) for name, place in IDENTITY_PLACES.items()},
    (0x1400, 1): 0x200 + NODE_ID,
    (0x1401, 1): INVALID | 0x300 + NODE_ID,
    (0x1800, 1): 0x4000_0180 + NODE_ID,
    **dict.fromkeys([(0x1001, 0), (0x1016, 1), (0x6040, 0), (0x6060, 0)], 0),
}

WATCHED: dict[str, Any] = {'node_id': 3, 'heartbeat_producer': 0.1, 'heartbeat_timeout': 0.25}


def io_config(**changes: object) -> NodeConfig:
    """Return a device with two RPDOs, a TPDO and two objects to be written."""
    config = drive_config(NODE, NODE_ID, driver='ros2_canopen::ProxyDriver')
    own = {
        'identity': IDENTITY,
        'boot_timeout': 1.0,
        'rpdos': (
            pdo(1, 0x205, (0x6040, 0), (0x6060, 0), transmission=255),
            replace(pdo(2, 0x305), enabled=False),
        ),
        'tpdos': (
            replace(
                pdo(1, 0x185, (0x6041, 0), (0x6064, 0)),
                inhibit_time=0.0015,
                event_time=0.1,
                sync_start=3,
            ),
        ),
        'sdo_writes': (sdo_write(0x6081, 0, 500), sdo_write(0x6098, 0, -1)),
    }
    return replace(config, **{**own, **changes})  # type: ignore[arg-type]  # fields by name


class Scene:
    """A master and scripted devices.

    Attributes:
        net: The network.
        devices: The devices by name.
        device: The first one.
        node: How the master sees it.
    """

    def __init__(
        self,
        *configs: NodeConfig,
        there: bool = True,
        keys: Sequence[str] = (),
        refuses: dict[tuple[int, int], int] | None = None,
        **master: Any,
    ) -> None:
        """Set the scene.

        Args:
            *configs: The devices, the usual one by default.
            there: They are switched on.
            keys: What bus.yml says of the first one, besides its node id.
            refuses: Abort codes of the first one by object.
            **master: Fields of MasterConfig.
        """
        configs = configs or (io_config(),)
        bus = bus_config(*configs, **master)
        if keys:
            places = [(NODE, *key.split('.')) for key in ('node_id', *keys)]
            locations = {place: Place(line=7, key='.'.join(place[1:])) for place in places}
            bus = replace(bus, locations=locations)
        self.net = VirtualNetwork(bus, absent=[config.name for config in configs])
        self.devices = {
            config.name: ScriptedDevice(
                config.node_id, partial(self.net.send_as, config.name), object_bytes(DEVICE_VALUES)
            )
            for config in configs
        }
        self.device = self.devices[configs[0].name]
        self.device.refuses.update(refuses or {})
        self.node: RemoteNode = self.net.network.nodes[configs[0].name]
        self.run, self.boot = self.net.run, self.net.boot
        if there:
            for name, device in self.devices.items():
                self.net.connect(name, device)

    def reported(self, kind: EventKind) -> list[str]:
        """Return what was reported of a kind."""
        return [event.text for event in self.net.events if event.kind is kind]

    def start(self, duration: float) -> None:
        """Start the master, and let time pass in [s]."""
        self.net.start()
        self.net.run(duration)


CONFIGURATION = [
    (0x1017, 0, 100),
    # RPDO 1 was valid
    *((0x1400, 1, INVALID | 0x200 + NODE_ID), (0x1400, 2, 255)),
    *((0x1600, 0, 0), (0x1600, 1, 0x6040_0010), (0x1600, 2, 0x6060_0008), (0x1600, 0, 2)),
    (0x1400, 1, 0x205),
    # RPDO 2 is to be off, and is
    # TPDO 1 of a device that knows no remote frames
    *((0x1800, 1, INVALID | 0x4000_0180 + NODE_ID), (0x1800, 2, 1)),
    *((0x1800, 3, 15), (0x1800, 5, 100), (0x1800, 6, 3)),
    *((0x1A00, 0, 0), (0x1A00, 1, 0x6041_0010), (0x1A00, 2, 0x6064_0020), (0x1A00, 0, 2)),
    (0x1800, 1, 0x4000_0185),
    *((0x6081, 0, 500), (0x6098, 0, 0xFF)),
]


def test_the_whole_configuration_in_its_order() -> None:
    """Error control, each PDO disabled, set, mapped and enabled, the list of bus.yml, start.

    No warning, no error, no time-out, no abort; a PDO that bus.yml does not name is left alone.
    """
    scene = Scene()
    scene.boot()
    assert scene.device.writes == CONFIGURATION
    scene.run(1.0)
    assert scene.device.commands == [RESET_COMMUNICATION, PRE_OPERATIONAL, START]
    assert scene.device.state is NmtState.OPERATIONAL
    assert scene.node.phase is BootPhase.OPERATIONAL
    assert scene.reported(EventKind.BOOT) == ['operational']
    assert scene.net.reported(Severity.WARNING) == []
    assert not [data for data in scene.net.frames(0x600 + NODE_ID) if data[0] == ABORT]
    assert (scene.node.sdo.counters.aborted, scene.node.sdo.counters.timed_out) == (0, 0)
    config = io_config()
    unnamed = replace(config.rpdos[0], configured=False)
    alone = Scene(replace(config, rpdos=(unnamed,), tpdos=()))
    alone.boot()
    assert not [write for write in alone.device.writes if 0x1400 <= write[0] < 0x1C00]


def test_a_device_is_asked_nothing_before_its_boot_up() -> None:
    """A question that gets lost in its reset is listed by other tools as a failure of it."""
    scene = Scene()
    scene.device.answers = scene.device.announces = False
    scene.start(0.1)  # of its reset
    scene.device.answers = scene.device.announces = True
    scene.device.restart(scene.net.now)
    scene.net.run_until(lambda: scene.node.online)
    questions, answers = (scene.net.frames(base + NODE_ID) for base in (0x600, 0x580))
    assert not [data for data in questions if data[0] == ABORT]
    assert len(questions) == len(answers)


def test_what_cannot_be_written_is_not_written() -> None:
    """Neither a heartbeat that is constant nor a mapping for ever; the rest of the PDO is."""
    config = io_config()
    constant = ObjectDictionary(
        replace(entry, access=AccessType.CONSTANT) if entry.index in (0x1016, 0x1017) else entry
        for entry in config.dictionary
    )
    fixed = replace(config.tpdos[0], fixed_mapping=True)
    scene = Scene(
        replace(
            config,
            dictionary=constant,
            heartbeat_timeout=0.0,
            rpdos=(),
            tpdos=(fixed,),
            sdo_writes=(),
        )
    )
    scene.boot()
    assert [write[:2] for write in scene.device.writes] == [
        *((0x1800, subindex) for subindex in (1, 2, 3, 5, 6, 1))
    ]


@pytest.mark.parametrize('held', [0, 0x0081_0064, 0x0080_0000])
def test_a_device_that_watches_the_master_gets_the_time(held: int) -> None:
    """0x1016:01 holds the master's id and its consumer time; a node id above 127 is a free one."""
    scene = Scene(io_config(heartbeat_consumer=True), **WATCHED)
    scene.device.values[0x1016, 1] = held.to_bytes(4, 'little')
    scene.boot()
    assert (0x1016, 1, 3 << 16 | 250) in scene.device.writes


def test_devices_are_not_started_when_the_master_shall_not() -> None:
    """With start_nodes false they stay pre-operational, and the report says so."""
    scene = Scene(start_nodes=False)
    scene.boot()
    scene.run(0.1)
    assert START not in scene.device.commands
    assert any('start_nodes' in text for text in scene.net.reported())


@pytest.mark.parametrize('name', IDENTITY_PLACES)
def test_another_device_is_refused_with_the_remedy(name: str) -> None:
    """Found and expected value, and the key of bus.yml; the right one boots by itself later.

    Where bus.yml and EDS have no value, any device will do.
    """
    any_will_do = Scene(io_config(identity=replace(IDENTITY, **{name: 0})))
    any_will_do.device.values[IDENTITY_PLACES[name]] = (0xBAD).to_bytes(4, 'little')
    any_will_do.boot()

    scene = Scene()
    right = scene.device.values[IDENTITY_PLACES[name]]
    scene.device.values[IDENTITY_PLACES[name]] = (0xBAD).to_bytes(4, 'little')
    scene.start(30.0)
    (failure,) = scene.reported(EventKind.BOOT_FAILED)
    title = name.replace('_', ' ')
    assert f'{NODE} (node {NODE_ID}) is another device: {title} 0x00000BAD' in failure
    assert f'expected 0x{getattr(IDENTITY, name):08X}' in failure
    assert f'correct {"dcf" if name == "device_type" else name}' in failure
    assert scene.device.writes == []
    assert START not in scene.device.commands
    assert scene.node.phase is BootPhase.FAILED
    assert '0x00000BAD' in scene.node.phase_detail
    scene.device.values[IDENTITY_PLACES[name]] = right
    scene.net.run_until(scene.net.all_ready, 3.0)


@pytest.mark.parametrize('place', [(0x1800, 2), (0x1A00, 1), (0x6081, 0), (0x1017, 0)])
def test_a_refused_configuration_is_reported_with_place_and_reason(place: tuple[int, int]) -> None:
    """The abort is reported in words with the object, once for each reason; boot is repeated.

    So is the time-out of a device that falls silent meanwhile; it is looked for again and found.
    """
    scene = Scene(refuses={place: 0x0609_0030})
    scene.start(30.0)
    (failure,) = scene.reported(EventKind.BOOT_FAILED)
    assert 'while configuring' in failure
    assert f'0x{place[0]:04X}:{place[1]:02X}: invalid value for parameter' in failure
    assert START not in scene.device.commands
    assert scene.device.commands.count(PRE_OPERATIONAL) > 5
    scene.device.refuses.clear()
    scene.device.refuses[0x6098, 0] = 0x0601_0002
    scene.run(5.0)
    assert len(scene.reported(EventKind.BOOT_FAILED)) == 2

    def fall_silent(request: bytes) -> None:
        if request[1:3] == b'\x00\x1a':
            scene.device.answers = False

    scene.device.refuses.clear()
    scene.device.on_request = fall_silent
    scene.run(20.0)
    _, _, silent, lost = scene.reported(EventKind.BOOT_FAILED)
    assert 'while configuring' in silent
    assert '0x1A00:' in silent
    assert 'no answer yet' in lost
    scene.device.on_request = lambda request: None
    scene.device.answers = True
    scene.net.run_until(scene.net.all_ready, 3.0)


@pytest.mark.parametrize('deaf', [True, False], ids=['runs on', 'restarts without a word'])
@pytest.mark.parametrize('known', [True, False], ids=['0x1000', 'abort'])
def test_a_device_that_misses_the_reset_is_found(*, known: bool, deaf: bool) -> None:
    """Without a boot-up message any answer to 0x1000 is enough, however slow.

    It is configured while it processes no PDOs: nothing is written before Pre-operational and
    after the start.
    """
    scene = Scene(io_config(identity=IDENTITY if known else Identity()))
    scene.device.announces, scene.device.deaf_to_reset = False, deaf
    scene.device.state = NmtState.OPERATIONAL
    scene.device.answer_time = 0.03  # [s] many think so long
    if not known:
        del scene.device.values[0x1000, 0]
    states: set[NmtState] = set()

    def note(request: bytes) -> None:
        if request[0] >> 5 == 1:
            states.add(scene.device.state)

    scene.device.on_request = note
    scene.boot()
    assert scene.reported(EventKind.BOOT_FAILED) == []
    assert states == {NmtState.PRE_OPERATIONAL}


@pytest.mark.parametrize('announces', [True, False])
def test_an_absent_device_is_waited_for_and_reported_once(announces: bool) -> None:
    """It joins whenever it comes, with a boot-up message or silently, within a poll."""
    scene = Scene(there=False)
    scene.start(60.0)
    failures = scene.reported(EventKind.BOOT_FAILED)
    assert len(failures) == 1
    assert 'power, wiring, termination' in failures[0]
    assert f'node id {NODE_ID} ' in failures[0]
    assert scene.node.phase is BootPhase.WAITING
    scene.device.announces = announces
    scene.net.connect(NODE, scene.device)
    scene.device.restart(scene.net.now)
    took = scene.net.run_until(scene.net.all_ready, 3.0)
    assert took < (0.2 if announces else 1.2)


def test_devices_boot_at_the_same_time() -> None:
    """One that does not answer holds nobody up."""
    net = VirtualNetwork(
        bus_config(*(drive_config(f'joint{n}', n) for n in range(2, 9))), absent=['joint4']
    )
    net.start()
    net.run(0.5)
    online = [name for name, node in net.network.nodes.items() if node.online]
    assert online == [f'joint{n}' for n in (2, 3, 5, 6, 7, 8)]


@settings(max_examples=15)
@given(st.sets(st.integers(0, 29), min_size=1, max_size=6))
@example({0})
@example({29})
@example(set(range(30)))
def test_a_restart_in_the_middle_of_a_boot_starts_it_again(moments: set[int]) -> None:
    """Whatever was under way: the new device gets the whole configuration, and no alarm.

    Nor does it get an abort, which other tools list as a failure of the device.
    """
    scene = Scene()
    requests = itertools.count()

    def restart(request: bytes) -> None:
        if next(requests) in moments:
            scene.device.restart(scene.net.now)

    scene.device.on_request = restart
    scene.boot()
    scene.run(0.5)
    assert next(requests) > max(moments)
    undisturbed = Scene()
    undisturbed.boot()
    assert scene.device.values == undisturbed.device.values
    assert scene.device.state is NmtState.OPERATIONAL
    assert scene.reported(EventKind.BOOT_FAILED) == []
    assert not [data for data in scene.net.frames(0x600 + NODE_ID) if data[0] == ABORT]
    assert scene.node.online


def test_a_device_without_heartbeat_is_reported_and_not_started_again() -> None:
    """Its loss would go unnoticed; the reasons are reported once each, and nothing after that."""
    scene = Scene()
    scene.device.beats = False
    scene.boot()
    scene.run(60.0)
    lost = scene.reported(EventKind.HEARTBEAT_LOST)
    failures = scene.reported(EventKind.BOOT_FAILED)
    assert len(lost) == 1
    assert '300 ms' in lost[0]
    assert len(failures) == 1
    assert 'sent no heartbeat within 300 ms' in failures[0]
    assert scene.device.commands.count(START) == 1
    assert not scene.node.online
    scene.device.beats = True
    scene.net.run_until(scene.net.all_ready, 3.0)


def test_a_cob_id_that_is_not_the_one_of_the_node_id_is_found_at_boot() -> None:
    """The EDS has none to rely on, so what the device has is compared, and the key named."""
    (tpdo,) = io_config().tpdos
    tpdo = replace(tpdo, configured=False, assumed=True, cob_id=0x180 + NODE_ID)
    scene = Scene(io_config(tpdos=(tpdo,)))
    scene.device.values[0x1800, 1] = (0x4000_0185).to_bytes(4, 'little')
    scene.start(1.5)
    (failure,) = scene.reported(EventKind.BOOT_FAILED)
    assert '0x1800:01 of io is 0x00000185, the master takes 0x00000189' in failure
    assert 'tpdo.1: {cob_id: auto}' in failure
    assert scene.device.commands.count(START) == 0
    scene.device.values[0x1800, 1] = (0x4000_0189).to_bytes(4, 'little')
    scene.net.run_until(scene.net.all_ready)


TOO_HIGH = 0x0609_0031  # Elmo's answer to 0x1016
NO_SUBINDEX = 0x0609_0011  # node-canopen's
READ_ONLY = 0x0601_0002  # ElmoSimplIQ's to 0x1400:01
OUT_OF_RANGE = 0x0609_0030
WATCHING = io_config(heartbeat_consumer=True)
WITHOUT_TPDOS = io_config(tpdos=())
CONSUMER_OFF = ('0x1016:01', 'heartbeat_consumer: false')
REFUSALS: dict[str, tuple[NodeConfig, str, tuple[int, int], int, tuple[str, ...], bool]] = {
    'no file says that it watches': (
        *(WATCHING, '', (0x1016, 1), TOO_HIGH, (*CONSUMER_OFF, 'when the master dies'), True),
    ),
    'it has no such sub-index': (WATCHING, '', (0x1016, 1), NO_SUBINDEX, CONSUMER_OFF, True),
    'bus.yml says that it watches': (
        *(WATCHING, 'heartbeat_consumer', (0x1016, 1), TOO_HIGH, CONSUMER_OFF[1:], False),
    ),
    'a COB-ID is fixed and another one': (
        *(WITHOUT_TPDOS, 'rpdo.1.cob_id', (0x1400, 1), READ_ONLY),
        *(('0x1400:01', 'rpdo.1.cob_id'), False),
    ),
    'a default of the EDS': (
        *(WITHOUT_TPDOS, 'rpdo.1.mapping', (0x1400, 2), OUT_OF_RANGE),
        *(('0x1400:02', 'rpdo.1.transmission'), True),
    ),
    'a heartbeat of bus.yml': (
        *(io_config(), 'heartbeat_producer', (0x1017, 0), OUT_OF_RANGE),
        *(('heartbeat_producer',), False),
    ),
}
"""Device, a key in its bus.yml, object and abort code; what the warning names; it boots."""


@pytest.mark.parametrize(
    ('config', 'key', 'place', 'code', 'words', 'boots'), REFUSALS.values(), ids=REFUSALS
)
def test_a_refusal_fails_the_boot_only_where_a_file_configures_the_object(
    config: NodeConfig,
    key: str,
    place: tuple[int, int],
    code: int,
    words: tuple[str, ...],
    *,
    boots: bool,
) -> None:
    """Else there is one warning with the consequence and the key."""
    scene = Scene(
        config, keys=['mandatory', key] if key else ['mandatory'], refuses={place: code}, **WATCHED
    )
    scene.start(3.0)
    (warning,) = scene.net.reported(Severity.WARNING)
    assert all(word in warning for word in words), warning
    assert (START in scene.device.commands) is scene.node.online is boots
    assert scene.node.watch_slot == 0


OWN_RPDO = replace(WITHOUT_TPDOS.rpdos[0], cob_id=0x200 + NODE_ID)
WATCHES = struct.pack('<I', 3 << 16 | 250)  # node id of the master, and time in [ms]
HELD: dict[str, tuple[NodeConfig, str, tuple[int, int], bytes]] = {
    'the watch of the master': (WATCHING, 'mandatory', (0x1016, 1), WATCHES),
    'a transmission type': (WITHOUT_TPDOS, 'rpdo.1.transmission', (0x1400, 2), b'\xff'),
    'a COB-ID': (
        *(replace(WITHOUT_TPDOS, rpdos=(OWN_RPDO,)), 'rpdo.1.mapping', (0x1400, 1)),
        struct.pack('<I', 0x200 + NODE_ID),  # with bit 31 it is off while its mapping changes
    ),
}


@pytest.mark.parametrize(('config', 'key', 'place', 'held'), HELD.values(), ids=HELD)
def test_a_value_that_the_device_has_is_no_reason_to_fail(
    config: NodeConfig, key: str, place: tuple[int, int], held: bytes
) -> None:
    """The object is constant, and right: no warning, and no COB-ID is written once more."""
    scene = Scene(config, keys=('mandatory', key), refuses={place: READ_ONLY}, **WATCHED)
    scene.device.values[place] = held
    requested: list[bytes] = []
    scene.device.on_request = requested.append
    scene.boot()
    assert scene.net.reported(Severity.WARNING) == []
    assert scene.node.watch_slot == (place == (0x1016, 1))
    cob_ids = [request[4:] for request in requested if request[:4] == b'\x23\x00\x14\x01']
    if place == (0x1400, 1):
        assert held not in cob_ids
        assert (0x1600, 0, 2) in scene.device.writes, 'its mapping was not written'


CONFIGURED = {
    (index, subindex): value
    for index, subindex, value in (*CONFIGURATION, (0x1401, 1, INVALID | 0x305))
    if 0x1400 <= index < 0x1C00
}
"""The PDO objects of a device that has been configured before."""

COMMANDED = {(0x6040, 0): 0x000F, (0x6060, 0): 8}


def running(**changes: object) -> Scene:
    """Return a network whose device has been configured and started by another master."""
    scene = Scene(io_config(**changes))
    scene.device.values |= object_bytes({**COMMANDED, **CONFIGURED})
    scene.device.state, scene.device.guarded = NmtState.OPERATIONAL, True
    return scene


def test_a_device_in_operation_is_taken_over_without_a_word() -> None:
    """No NMT command, no PDO object written; an RPDO carries what the device has beside."""
    network = running(reset_communication=False)
    device = network.device
    network.start(1.0)
    node = network.node
    assert node.online
    assert node.taken_over
    assert device.commands == []
    assert {index for index, _, _ in device.writes} == {0x1017}
    assert network.net.frames(0x205) == []
    network.net.network.publish_objects(node, {(0x6060, 0): 9})
    assert network.net.frames(0x205) == [b'\x0f\x00\x09']
    assert any('taken over' in text and 'error L' in text for text in network.net.reported())


OTHER_PDOS = ('0x1A00:02 is 0x606C0020 instead of 0x60640020', 'to have it configured')
NO_STATE = ('boot error K: no heartbeat', 'does not send its NMT state', 'once, or remove reset_')


@pytest.mark.parametrize('words', [OTHER_PDOS, NO_STATE], ids=['other PDOs', 'no NMT state'])
def test_a_device_that_may_run_otherwise_is_left_alone(words: tuple[str, ...]) -> None:
    """Nothing is sent that could disturb it; reason and remedy are reported, and a reset helps."""
    network = running(reset_communication=False)
    device = network.device
    if words is OTHER_PDOS:
        device.values[0x1A00, 2] = (0x606C_0020).to_bytes(4, 'little')
    else:
        device.guarded = False
    network.start(5.0)
    assert device.commands == []
    assert network.net.frames(0x205) == []
    (reported,) = network.net.reported(Severity.WARNING)
    assert all(word in reported for word in (*words, 'Call ~/nmt_reset_node')), reported
    network.net.network.send_nmt(NmtCommand.RESET_NODE, NODE_ID)
    network.net.run(3.0)
    assert network.node.online
    assert device.commands == [RESET_NODE, PRE_OPERATIONAL, START]


@pytest.mark.parametrize(
    ('key', 'commands'), [('reset_communication', [PRE_OPERATIONAL, START]), ('boot', [])]
)
def test_a_device_that_does_not_run_is_configured_where_the_master_may(
    key: str, commands: list[int]
) -> None:
    """Kept alive it is not reset; with `boot: false` it is taken as it is, whatever its state."""
    network = running(**{key: False})
    device = network.device
    device.state = NmtState.PRE_OPERATIONAL
    network.start(2.0)
    assert device.commands == commands
    assert bool(device.writes) is bool(commands)
    assert network.node.online


def test_defaults_are_restored_once_before_the_configuration() -> None:
    """`restore_configuration`: 'load' to 0x1011, a reset, and then the configuration."""
    network = Scene(io_config(restore_configuration=1))
    device = network.devices[NODE]
    device.values[0x1011, 1] = bytes(4)
    loads: list[list[int]] = []

    def note(request: bytes) -> None:
        if request[:4] == b'\x23\x11\x10\x01':
            loads.append(list(device.commands))
            assert request[4:] == b'load'

    device.on_request = note
    network.start(3.0)
    assert loads == [[RESET_COMMUNICATION, PRE_OPERATIONAL]]
    assert device.commands[2:] == [RESET_NODE, PRE_OPERATIONAL, START]
    assert network.node.online
    assert device.writes[0][0] == 0x1017


def two(**changes: object) -> tuple[NodeConfig, NodeConfig]:
    """Return a mandatory device and an optional one."""
    first = io_config(mandatory=True, **changes)
    second = replace(
        first,
        name='other',
        node_id=10,
        mandatory=False,
        rpdos=(replace(first.rpdos[0], cob_id=0x206),),
        tpdos=(replace(first.tpdos[0], cob_id=0x186),),
    )
    return first, second


def test_nobody_is_started_without_the_mandatory_device() -> None:
    """The others wait, configured; the time that is over is reported with what is missing."""
    network = Scene(*two(), boot_time=2.0)
    network.devices[NODE].answers = network.devices[NODE].announces = False
    network.start(1.5)
    other = network.net.network.nodes['other']
    assert other.phase is BootPhase.HELD
    assert START not in network.devices['other'].commands
    network.net.run(1.0)
    assert any(
        'mandatory devices have not booted within 2 s' in text and NODE in text
        for text in network.net.reported(Severity.ERROR)
    )
    network.devices[NODE].answers = True
    network.net.run(3.0)
    for device in network.devices.values():
        assert device.commands[-1] == START
    assert other.online


def test_all_are_started_by_one_frame() -> None:
    """`start_all_nodes`: when all are there, one broadcast."""
    network = Scene(*two(), start_all_nodes=True)
    network.start(2.0)
    starts = [data for data in network.net.frames(0x000) if data[0] == START]
    assert starts == [b'\x01\x00']
    assert all(node.online for node in network.net.network.nodes.values())


@pytest.mark.parametrize(
    ('master', 'command', 'message'),
    [
        ({'reset_all_nodes': True}, RESET_NODE, 'all devices are reset'),
        ({'stop_all_nodes': True}, STOP, 'all devices are stopped'),
        ({}, None, 'go on without it'),
    ],
)
def test_the_loss_of_a_mandatory_device(
    master: dict[str, Any], command: int | None, message: str
) -> None:
    """The others do what bus.yml configures, and it is reported."""
    network = Scene(*two(), **master)
    network.start(2.0)
    lost, other = network.devices[NODE], network.devices['other']
    other.commands.clear()
    lost.answers = lost.beats = lost.announces = False
    lost._beat_due = None
    network.net.run(0.6)
    assert any(message in text for text in network.net.reported(Severity.ERROR))
    assert other.commands[:1] == ([] if command is None else [command])


@pytest.mark.parametrize('master', [{'reset_all_nodes': True}, {'stop_all_nodes': True}])
@pytest.mark.parametrize('ours', [True, False], ids=['our_service', 'other_tool'])
def test_a_commanded_state_of_a_mandatory_device_is_no_loss(
    master: dict[str, Any], *, ours: bool
) -> None:
    """Whoever commanded it wants the others to go on."""
    network = Scene(*two(), **master)
    network.start(2.0)
    other = network.devices['other']
    other.commands.clear()
    for command in (PRE_OPERATIONAL, STOP, START, RESET_NODE, RESET_COMMUNICATION):
        network.device.commands.clear()
        if ours:
            network.net.network.send_nmt(NmtCommand(command), NODE_ID)
        else:
            network.net.send_as('tool', Frame(0x000, bytes((command, NODE_ID))))
        network.run(2.0)
        assert command in network.device.commands
        assert other.commands == [], hex(command)
    assert not any('mandatory and lost' in text for text in network.net.reported())


def test_a_master_that_shall_not_start_waits_for_its_command() -> None:
    """`start: false`: no SYNC and no RPDO before NMT start to its own id."""
    network = Scene(io_config(), start=False)
    network.start(1.0)
    assert network.net.frames(0x080) == []
    node = network.node
    with pytest.raises(CanopenError, match='the master is not operational'):
        network.net.network.publish_objects(node, {(0x6060, 0): 1})
    network.net.network.send_nmt(NmtCommand.START, network.net.network.config.master.node_id)
    network.net.run(0.1)
    assert network.net.frames(0x080)
    network.net.network.publish_objects(node, {(0x6060, 0): 1})
    assert network.net.frames(0x205)


OPERATING_TIME = 0.15  # [s] before it falls back
EMCY = bytes((0x30, 0x81, 0x11, 0, 0, 0, 0, 0))  # 0x8130: life guard or heartbeat error


def relapsing() -> Scene:
    """Start a master with a device that falls back soon after each start."""
    scene = Scene()
    scene.device.relapses_after = OPERATING_TIME
    scene.net.start()
    return scene


def starts(scene: Scene) -> list[float]:
    """Return when the device was started in [s]."""
    start = Frame(0x000, bytes((START, NODE_ID)))
    return [sent.time for sent in scene.net.wire.log if sent.frame == start]


def test_a_device_that_falls_back_is_left_alone_longer_and_longer() -> None:
    """The pauses double up to half a minute: 9 boots in 2 minutes, not 130.

    After some time in operation the next drop is the first one again.
    """
    scene = relapsing()
    scene.run(120.0)
    times = starts(scene)
    pauses = [later - time for time, later in itertools.pairwise(times)]
    assert all(later > 1.5 * pause for pause, later in itertools.pairwise(pauses[:5]))
    assert max(pauses) < LONGEST_PAUSE + 1.0
    assert len(times) < 10
    scene.device.relapses_after = None
    scene.run(40.0 + STABLE_TIME)
    assert scene.node.online
    scene.device.state = NmtState.PRE_OPERATIONAL
    before = len(starts(scene))
    scene.net.run_until(lambda: len(starts(scene)) == before + 1, 3.0)


@pytest.mark.parametrize(('emcy', 'reason'), [(EMCY, '0x8130'), (b'', 'no EMCY')])
def test_the_reason_is_its_emcy(emcy: bytes, reason: str) -> None:
    """Each drop names it, and when the device is booted again; so does the boot phase."""
    scene = relapsing()
    scene.device.last_words = emcy
    scene.run(3.0)
    reported = scene.reported(EventKind.HEARTBEAT_LOST)
    assert len(reported) >= 2
    assert all(reason in text for text in reported)
    scene.net.run_until(lambda: not scene.node.online, 60.0)
    assert reason in scene.node.phase_text


def test_a_device_that_never_reports_its_state_is_in_the_commanded_one() -> None:
    """Operational after its boot, and what somebody commands afterwards.

    Without heartbeat and node guarding its silence is no loss; its boot-up message is a restart.
    """
    config = replace(drive_config(NODE, NODE_ID), heartbeat_producer=0.0, heartbeat_timeout=0.0)
    mute = booted(config)
    node = mute.network.nodes[NODE]
    states = [(node.nmt_state, node.operational)]
    for command in (NmtCommand.ENTER_PRE_OPERATIONAL, NmtCommand.START):
        mute.network.send_nmt(command, NODE_ID)
        states.append((node.nmt_state, node.operational))
    running, stopped = (NmtState.OPERATIONAL, True), (NmtState.PRE_OPERATIONAL, False)
    assert states == [running, stopped, running]
    mute.power_off(NODE)
    mute.run(10.0)
    assert node.online
    assert node_status(node, mute.now).heartbeat_age is None
    mute.power_on(NODE)
    mute.run(0.01)
    assert node.nmt_state is not NmtState.OPERATIONAL
    mute.run_until(lambda: node.online)
    reported = [event.text for event in mute.events if event.kind is EventKind.NMT_STATE]
    assert reported[-1] == 'NMT state OPERATIONAL'
