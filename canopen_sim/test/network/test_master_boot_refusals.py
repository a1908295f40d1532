# SPDX-FileCopyrightText: 2026 The arm and quad developers
# SPDX-License-Identifier: Apache-2.0
"""Devices that refuse a part of the boot plan: what no file configures does not stop the boot."""

from __future__ import annotations

from dataclasses import replace
import struct

from bus_rig import VirtualNetwork
from drive_samples import bus_config
import pytest
from scripted_device import object_bytes, ScriptedDevice, START
from test_master_boot import DEVICE_VALUES, io_config, NODE, NODE_ID

from arm_canopen import Severity
from arm_canopen.config import NodeConfig
from arm_canopen.config.model import Place
from arm_canopen.standard import NmtState

TOO_HIGH = 0x0609_0031  # Elmo's answer to 0x1016
NO_SUBINDEX = 0x0609_0011  # node-canopen's
READ_ONLY = 0x0601_0002  # ElmoSimplIQ's to 0x1400:01
OUT_OF_RANGE = 0x0609_0030
WATCHING = {'node_id': 3, 'heartbeat_producer': 0.1, 'heartbeat_timeout': 0.25}


class Refusing:
    """A master whose bus.yml has some keys of a device, and the device.

    Attributes:
        net: The network.
        device: The device.
    """

    def __init__(
        self, config: NodeConfig, *keys: str, refuses: dict[tuple[int, int], int]
    ) -> None:
        """Switch the device on."""
        locations = {(NODE, *key.split('.')): Place(line=7, key=key) for key in ('node_id', *keys)}
        bus = replace(bus_config(config, **WATCHING), locations=locations)
        self.net = VirtualNetwork(bus, absent=[NODE])
        self.device = ScriptedDevice(
            NODE_ID,
            lambda frame: self.net.send_as(NODE, frame),
            object_bytes(DEVICE_VALUES),
            refuses=refuses,
        )
        self.net.connect(NODE, self.device)

    def boot(self) -> list[str]:
        """Boot the device, and return the warnings."""
        self.net.boot()
        self.net.run(0.05)
        assert self.device.state is NmtState.OPERATIONAL
        return self.net.reported(Severity.WARNING)

    def fail(self) -> str:
        """Return why the device is not started."""
        self.net.start()
        self.net.run(3.0)
        assert START not in self.device.commands
        (reason,) = self.net.reported(Severity.WARNING)
        return reason


@pytest.mark.parametrize('code', [TOO_HIGH, NO_SUBINDEX])
def test_a_device_that_cannot_watch_the_master_boots(code: int) -> None:
    """No file configures it: one warning with the consequence and the key."""
    scene = Refusing(io_config(heartbeat_consumer=True), refuses={(0x1016, 1): code})
    (warning,) = scene.boot()
    assert '0x1016:01' in warning
    assert 'when the master dies' in warning
    assert 'heartbeat_consumer: false' in warning
    assert scene.net.network.nodes[NODE].watch_slot == 0


def test_a_device_that_watches_the_master_already_is_left_in_peace_at_the_end() -> None:
    """Its 0x1016 is constant, and right: the master that goes undoes the watch where it can."""
    scene = Refusing(io_config(heartbeat_consumer=True), refuses={(0x1016, 1): READ_ONLY})
    scene.device.values[0x1016, 1] = struct.pack('<I', 3 << 16 | 250)  # node id, and time in [ms]
    assert scene.boot() == []
    assert scene.net.network.nodes[NODE].watch_slot == 1


def test_a_device_that_shall_watch_the_master_has_to() -> None:
    """Where bus.yml configures it, the device is not started; the key is named."""
    config = io_config(heartbeat_consumer=True)
    scene = Refusing(config, 'heartbeat_consumer', refuses={(0x1016, 1): TOO_HIGH})
    assert 'heartbeat_consumer: false' in scene.fail()


def test_a_cob_id_that_is_right_already_is_not_written() -> None:
    """A device whose COB-ID is read-only boots with the PDO that it has, and gets no write."""
    config = io_config()
    rpdo = replace(config.rpdos[0], cob_id=0x200 + NODE_ID)
    config = replace(config, rpdos=(rpdo,), tpdos=())
    scene = Refusing(config, 'rpdo.1.mapping', refuses={(0x1400, 1): READ_ONLY})
    requested: list[bytes] = []
    scene.device.on_request = requested.append
    assert scene.boot() == []
    assert (0x1600, 0, 2) in scene.device.writes
    right = struct.pack('<I', 0x200 + NODE_ID)  # with bit 31 it is off while its mapping changes
    written = [request[4:] for request in requested if request[:4] == b'\x23\x00\x14\x01']
    assert right not in written


def test_a_cob_id_that_is_wrong_and_fixed_is_refused_with_the_key() -> None:
    """bus.yml has another identifier than the device can have."""
    config = replace(io_config(), tpdos=())
    refuses = {(0x1400, 1): READ_ONLY}
    reason = Refusing(config, 'rpdo.1.cob_id', refuses=refuses).fail()
    assert '0x1400:01' in reason
    assert 'rpdo.1.cob_id' in reason


def test_a_value_that_the_device_has_is_no_reason_to_fail() -> None:
    """A constant transmission type that is the wanted one."""
    config = replace(io_config(), tpdos=())
    scene = Refusing(config, 'rpdo.1.transmission', refuses={(0x1400, 2): READ_ONLY})
    scene.device.values[0x1400, 2] = bytes((config.rpdos[0].transmission,))
    assert scene.boot() == []


def test_a_default_that_the_device_refuses_is_a_warning() -> None:
    """The transmission type is the one of the EDS, which bus.yml does not name."""
    config = replace(io_config(), tpdos=())
    scene = Refusing(config, 'rpdo.1.mapping', refuses={(0x1400, 2): OUT_OF_RANGE})
    (warning,) = scene.boot()
    assert '0x1400:02' in warning
    assert 'rpdo.1.transmission' in warning


def test_a_heartbeat_of_bus_yml_has_to_be() -> None:
    """Its refusal names the key."""
    scene = Refusing(io_config(), 'heartbeat_producer', refuses={(0x1017, 0): OUT_OF_RANGE})
    assert 'heartbeat_producer' in scene.fail()


@pytest.mark.parametrize('held', [0x0081_0064, 0x0080_0000])
def test_an_entry_that_is_not_used_is_free(held: int) -> None:
    """One that names a node id above 127 watches nobody, and is not that of the master."""
    scene = Refusing(io_config(heartbeat_consumer=True), refuses={})
    scene.device.values[0x1016, 1] = held.to_bytes(4, 'little')
    scene.boot()
    assert (0x1016, 1, 3 << 16 | 250) in scene.device.writes
