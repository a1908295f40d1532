# SPDX-FileCopyrightText: 2026 The arm and quad developers
# SPDX-License-Identifier: Apache-2.0
"""Booting a device that does what the test wants: identity, configuration, start, and mishaps."""

from __future__ import annotations

from dataclasses import replace
import itertools

from bus_rig import VirtualNetwork
from drive_samples import bus_config, drive_config, pdo, sdo_write
import pytest
from scripted_device import (
    object_bytes,
    PRE_OPERATIONAL,
    RESET_COMMUNICATION,
    ScriptedDevice,
    START,
)

from arm_canopen import EventKind, Severity
from arm_canopen.config import Identity, NodeConfig
from arm_canopen.master.remote_node import BootPhase, RemoteNode
from arm_canopen.standard import AccessType, NmtState, ObjectDictionary

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
IDENTITY_PLACES: dict[str, tuple[int, int]] = {
    'device_type': (0x1000, 0),
    'vendor_id': (0x1018, 1),
    'product_code': (0x1018, 2),
    'revision_number': (0x1018, 3),
    'serial_number': (0x1018, 4),
}
DEFAULT_COB_IDS = {
    (0x1400, 1): 0x200 + NODE_ID,
    (0x1401, 1): INVALID | 0x300 + NODE_ID,
    (0x1800, 1): 0x4000_0180 + NODE_ID,
}
DEVICE_VALUES = {
    **{place: getattr(IDENTITY, name) for name, place in IDENTITY_PLACES.items()},
    **DEFAULT_COB_IDS,
    (0x1001, 0): 0,
    (0x1016, 1): 0,
    (0x6040, 0): 0,
    (0x6060, 0): 0,
}


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
    """A master and the scripted device.

    Attributes:
        net: The network.
        device: The device.
        node: How the master sees it.
    """

    def __init__(self, config: NodeConfig | None = None, *, there: bool = True) -> None:
        """Set the scene; with ``there``, the device is switched on."""
        self.net = VirtualNetwork(bus_config(config or io_config()), absent=[NODE])
        self.device = ScriptedDevice(
            NODE_ID,
            lambda frame: self.net.send_as(NODE, frame),
            object_bytes(DEVICE_VALUES),
        )
        self.node: RemoteNode = self.net.network.nodes[NODE]
        if there:
            self.net.connect(NODE, self.device)

    def reported(self, kind: EventKind) -> list[str]:
        """Return what was reported of a kind."""
        return [event.text for event in self.net.events if event.kind is kind]

    def run(self, duration: float) -> None:
        """Let time pass in [s]."""
        self.net.run(duration)

    def boot(self) -> None:
        """Start the master, and wait until the device is booted."""
        self.net.boot()


def test_the_whole_configuration_in_its_order() -> None:
    """Error control, each PDO disabled, set, mapped and enabled, the list of bus.yml, start."""
    scene = Scene()
    scene.boot()
    assert scene.device.writes == [
        (0x1017, 0, 100),
        # RPDO 1 was valid
        (0x1400, 1, INVALID | 0x200 + NODE_ID),
        (0x1400, 2, 255),
        (0x1600, 0, 0),
        (0x1600, 1, 0x6040_0010),
        (0x1600, 2, 0x6060_0008),
        (0x1600, 0, 2),
        (0x1400, 1, 0x205),
        # RPDO 2 shall not exist, and does not
        # TPDO 1 of a device that knows no remote frames
        (0x1800, 1, INVALID | 0x4000_0180 + NODE_ID),
        (0x1800, 2, 1),
        (0x1800, 3, 15),
        (0x1800, 5, 100),
        (0x1800, 6, 3),
        (0x1A00, 0, 0),
        (0x1A00, 1, 0x6041_0010),
        (0x1A00, 2, 0x6064_0020),
        (0x1A00, 0, 2),
        (0x1800, 1, 0x4000_0185),
        (0x6081, 0, 500),
        (0x6098, 0, 0xFF),
    ]
    scene.run(0.01)
    assert scene.device.commands == [RESET_COMMUNICATION, PRE_OPERATIONAL, START]
    assert scene.device.state is NmtState.OPERATIONAL
    assert scene.node.phase is BootPhase.OPERATIONAL
    assert scene.reported(EventKind.BOOT) == ['operational']


@pytest.mark.parametrize('running', [True, False], ids=['in operation', 'at the start'])
def test_a_device_that_restarts_gets_no_abort(*, running: bool) -> None:
    """Nor a question before its boot-up: other tools list either as a failure of the device."""
    scene = Scene()
    if running:
        scene.boot()
        scene.device.answers = False
        scene.node.sdo.read(0x1008, 0, 1.0)
        scene.run(0.01)
        scene.device.answers = True
        scene.device.restart(scene.net.now)
    else:
        scene.device.answers = scene.device.announces = False
        scene.net.start()
        scene.run(0.1)  # of its reset
        scene.device.answers = scene.device.announces = True
        scene.device.restart(scene.net.now)
    scene.net.run_until(lambda: scene.node.online)
    questions, answers = (scene.net.frames(base + NODE_ID) for base in (0x600, 0x580))
    assert not [data for data in questions if data[0] == ABORT]
    assert len(questions) == len(answers) + running  # none is lost in the reset


def test_nothing_is_written_before_pre_operational_and_after_start() -> None:
    """The device is configured while it processes no PDOs, also when it received no reset."""
    scene = Scene()
    scene.device.state = NmtState.OPERATIONAL
    scene.device.deaf_to_reset = True
    states: set[NmtState] = set()

    def note(request: bytes) -> None:
        if request[0] >> 5 == 1:
            states.add(scene.device.state)

    scene.device.on_request = note
    scene.boot()
    assert states == {NmtState.PRE_OPERATIONAL}


def test_what_bus_yml_does_not_name_is_left_alone() -> None:
    """A PDO that is not configured keeps what the device has."""
    config = io_config()
    config = replace(config, rpdos=(replace(config.rpdos[0], configured=False),), tpdos=())
    scene = Scene(config)
    scene.boot()
    assert not [write for write in scene.device.writes if 0x1400 <= write[0] < 0x1C00]


def test_a_mapping_for_ever_is_not_written() -> None:
    """A device with a read-only mapping gets its parameters only."""
    fixed = replace(io_config().tpdos[0], fixed_mapping=True)
    scene = Scene(io_config(rpdos=(), tpdos=(fixed,), sdo_writes=()))
    scene.boot()
    writes = [(0x1017, 0), (0x1800, 1), (0x1800, 2), (0x1800, 3), (0x1800, 5), (0x1800, 6)]
    assert [write[:2] for write in scene.device.writes] == [*writes, (0x1800, 1)]


def test_constant_error_control_objects_are_not_written() -> None:
    """A device whose heartbeat cannot be set is booted all the same."""
    config = io_config()
    constant = ObjectDictionary(
        replace(entry, access=AccessType.CONSTANT) if entry.index in (0x1016, 0x1017) else entry
        for entry in config.dictionary
    )
    scene = Scene(replace(config, dictionary=constant, heartbeat_timeout=0.0))
    scene.boot()
    assert not [write for write in scene.device.writes if write[0] in (0x1016, 0x1017)]


def test_a_device_that_watches_the_master_gets_the_time() -> None:
    """0x1016:01 holds the master's id and its consumer time."""
    net_config = bus_config(
        io_config(heartbeat_consumer=True),
        node_id=3,
        heartbeat_producer=0.1,
        heartbeat_timeout=0.25,
    )
    scene = Scene()
    net = VirtualNetwork(net_config, absent=[NODE])
    device = replace(scene.device, send=lambda frame: net.send_as(NODE, frame))
    net.connect(NODE, device)
    net.boot()
    assert (0x1016, 1, 3 << 16 | 250) in device.writes


def test_devices_are_not_started_when_the_master_shall_not() -> None:
    """With start_nodes false they stay pre-operational, and the report says so."""
    net = VirtualNetwork(bus_config(io_config(), start_nodes=False), absent=[NODE])
    scene = Scene()
    device = replace(scene.device, send=lambda frame: net.send_as(NODE, frame))
    net.connect(NODE, device)
    net.boot()
    net.run(0.1)
    assert START not in device.commands
    assert any('start_nodes' in text for text in net.reported())


@pytest.mark.parametrize('name', IDENTITY_PLACES)
def test_another_device_is_refused_with_the_remedy(name: str) -> None:
    """Found and expected value, and the key of bus.yml; not configured, and reported once."""
    scene = Scene()
    scene.device.values[IDENTITY_PLACES[name]] = (0xBAD).to_bytes(4, 'little')
    scene.net.start()
    scene.run(30.0)
    failures = scene.reported(EventKind.BOOT_FAILED)
    assert len(failures) == 1
    expected = getattr(IDENTITY, name)
    title = name.replace('_', ' ')
    assert f'{NODE} (node {NODE_ID}) is another device: {title} 0x00000BAD' in failures[0]
    assert f'expected 0x{expected:08X}' in failures[0]
    key = 'dcf' if name == 'device_type' else name
    assert f'correct {key}' in failures[0]
    assert scene.device.writes == []
    assert START not in scene.device.commands
    assert scene.node.phase is BootPhase.FAILED
    assert '0x00000BAD' in scene.node.phase_detail


@pytest.mark.parametrize('name', IDENTITY_PLACES)
def test_an_expected_0_is_not_checked(name: str) -> None:
    """Any device will do where bus.yml and EDS have no value."""
    scene = Scene(io_config(identity=replace(IDENTITY, **{name: 0})))
    scene.device.values[IDENTITY_PLACES[name]] = (0xBAD).to_bytes(4, 'little')
    scene.boot()


def test_the_right_device_in_place_of_the_wrong_is_booted() -> None:
    """After the mistake is corrected the device is booted without anybody asking."""
    scene = Scene()
    scene.device.values[0x1018, 2] = (0xBAD).to_bytes(4, 'little')
    scene.net.start()
    scene.run(5.0)
    scene.device.values[0x1018, 2] = IDENTITY.product_code.to_bytes(4, 'little')
    scene.net.run_until(scene.net.all_ready, 3.0)


@pytest.mark.parametrize('place', [(0x1800, 2), (0x1A00, 1), (0x6081, 0), (0x1017, 0)])
def test_a_refused_configuration_is_reported_with_place_and_reason(place: tuple[int, int]) -> None:
    """The abort is reported in words with the object, once; boot is repeated."""
    scene = Scene()
    scene.device.refuses[place] = 0x0609_0030
    scene.net.start()
    scene.run(30.0)
    failures = scene.reported(EventKind.BOOT_FAILED)
    index, subindex = place
    assert len(failures) == 1
    assert 'while configuring' in failures[0]
    assert f'0x{index:04X}:{subindex:02X}: invalid value for parameter' in failures[0]
    assert START not in scene.device.commands
    assert scene.device.commands.count(PRE_OPERATIONAL) > 5
    scene.device.refuses.clear()
    scene.net.run_until(scene.net.all_ready, 3.0)


def test_another_reason_is_reported_again() -> None:
    """A new reason is reported, too."""
    scene = Scene()
    scene.device.refuses[0x6081, 0] = 0x0609_0030
    scene.net.start()
    scene.run(5.0)
    scene.device.refuses.clear()
    scene.device.refuses[0x6098, 0] = 0x0601_0002
    scene.run(5.0)
    assert len(scene.reported(EventKind.BOOT_FAILED)) == 2


def test_a_device_that_misses_the_reset_is_found() -> None:
    """Without a boot-up message its answer to 0x1000 is enough."""
    scene = Scene()
    scene.device.announces = False
    scene.boot()
    assert scene.reported(EventKind.BOOT_FAILED) == []


def test_a_device_that_knows_no_0x1000_is_found_by_its_abort() -> None:
    """Any answer shows that somebody is there."""
    scene = Scene(io_config(identity=Identity()))
    scene.device.announces = False
    del scene.device.values[0x1000, 0]
    scene.boot()


@pytest.mark.parametrize('announces', [True, False])
def test_an_absent_device_is_waited_for_and_reported_once(announces: bool) -> None:
    """It joins whenever it comes, with a boot-up message or silently, within a poll."""
    scene = Scene(there=False)
    scene.net.start()
    scene.run(60.0)
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


@pytest.mark.parametrize('after', range(0, 30, 3))
def test_a_restart_in_the_middle_of_a_boot_starts_it_again(after: int) -> None:
    """Whatever was under way: the new device gets the whole configuration, and no alarm."""
    scene = Scene()
    requests = itertools.count()
    restarted: list[bool] = []

    def restart_once(request: bytes) -> None:
        if next(requests) == after and not restarted:
            restarted.append(True)
            scene.device.restart(scene.net.now)

    scene.device.on_request = restart_once
    scene.boot()
    scene.run(0.5)
    assert restarted
    undisturbed = Scene()
    undisturbed.boot()
    assert scene.device.values == undisturbed.device.values
    assert scene.device.state is NmtState.OPERATIONAL
    assert scene.reported(EventKind.BOOT_FAILED) == []
    assert scene.node.online


def test_boot_up_messages_without_end_are_survived() -> None:
    """A device in a reset loop is booted when the loop ends."""
    scene = Scene()
    scene.net.start()
    for _ in range(50):
        scene.run(0.003)
        scene.device.restart(scene.net.now)
    scene.net.run_until(lambda: scene.node.online, 1.0)
    assert scene.device.state is not NmtState.STOPPED


def test_a_device_that_falls_silent_while_it_is_configured() -> None:
    """The time-out names the object; the device is looked for again and found."""
    scene = Scene()

    def fall_silent(request: bytes) -> None:
        if request[1:3] == b'\x00\x1a':
            scene.device.answers = False

    scene.device.on_request = fall_silent
    scene.net.start()
    scene.run(20.0)
    failures = scene.reported(EventKind.BOOT_FAILED)
    assert 'while configuring' in failures[0]
    assert '0x1A00:' in failures[0]
    assert 'no answer yet' in failures[1]
    assert len(failures) == 2
    scene.device.on_request = lambda request: None
    scene.device.answers = True
    scene.net.run_until(scene.net.all_ready, 3.0)


@pytest.mark.slow
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
    scene.net.start()
    scene.run(1.5)
    (failure,) = scene.reported(EventKind.BOOT_FAILED)
    assert '0x1800:01 of io is 0x00000185, the master takes 0x00000189' in failure
    assert 'tpdo.1: {cob_id: auto}' in failure
    assert scene.device.commands.count(START) == 0
    scene.device.values[0x1800, 1] = (0x4000_0189).to_bytes(4, 'little')
    scene.net.run_until(scene.net.all_ready)


def test_slow_answers_do_not_fail_a_boot() -> None:
    """A device that thinks for 30 ms about each object is booted (many do)."""
    scene = Scene()
    scene.device.answer_time = 0.03
    scene.boot()
    assert scene.reported(EventKind.BOOT_FAILED) == []


def test_nothing_is_an_error_in_a_boot_that_goes_well() -> None:
    """No warning, no error, no time-out, no abort."""
    scene = Scene()
    scene.boot()
    scene.run(1.0)
    assert scene.net.reported(Severity.WARNING) == []
    sent = scene.net.frames(0x600 + NODE_ID)
    assert not [data for data in sent if data[0] == 0x80], 'the read before the boot-up, too'
    assert scene.node.sdo.counters.aborted == 0
    assert scene.node.sdo.counters.timed_out == 0
