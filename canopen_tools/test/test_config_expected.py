# SPDX-FileCopyrightText: 2026 The arm and quad developers
# SPDX-License-Identifier: Apache-2.0
"""What a device should hold by the files is what the master writes at boot."""

from __future__ import annotations

from dataclasses import replace

from device_rig import Rig
import pytest
from virtual_network import bus_config, drive_config, drive_dictionary, VirtualNetwork

from arm_canopen.config.boot_plan import BootWrite
from arm_canopen.config.identity import Identity
from canopen_tools.expected import expected_defaults, expected_objects


def test_a_booted_device_holds_what_is_expected() -> None:
    """After boot every object that diff compares is equal, and before it was not."""
    node = drive_config('joint1', 2, identity=Identity(0x20192, 0xFFFF, 0x402))
    timed = replace(node.tpdos[0], inhibit_time=0.002, event_time=0.5, transmission=255)
    node = replace(node, tpdos=(timed, *node.tpdos[1:]), heartbeat_consumer=True)
    rpdo = replace(node.rpdos[2], enabled=False, cob_id=0)
    node = replace(node, rpdos=(*node.rpdos[:2], rpdo))
    config = bus_config(node, heartbeat_producer=0.2, heartbeat_timeout=0.6)
    expected = expected_objects(config, node)
    addresses = {(item.index, item.subindex) for item in expected}
    assert addresses >= {(0x1000, 0), (0x1018, 2), (0x1016, 1), (0x1017, 0), (0x1402, 1)}
    assert addresses >= {(0x1800, 3), (0x1800, 5), (0x1A00, 0), (0x1A01, 2), (0x60C2, 1)}
    network = VirtualNetwork(config)
    device = network.network.nodes['joint1'].sdo

    def held(item: BootWrite) -> bytes:
        data = network.result(device.read(item.index, item.subindex, 0.5))
        assert isinstance(data, bytes)
        return data

    network.boot()
    wrong = [hex(item.index) for item in expected if not item.fits(held(item))]
    assert wrong == []
    new = Rig(drive_dictionary(), node_id=2)
    other = {item.index for item in expected if not item.fits(new.read(item.index, item.subindex))}
    assert other >= {0x1016, 0x1017, 0x1402, 0x1800, 0x1A00, 0x1A01, 0x6081}


@pytest.mark.parametrize(
    ('data', 'mask', 'device', 'fits'),
    [
        (b'\x05', None, b'\x05', True),
        (b'\x05', None, b'\x05\0\0\0', True),
        (b'\x05', None, b'\x06\0\0\0', False),
        (b'\x05\0', None, b'\x05', False),
        (b'\x82\x01\0\0', 0x800007FF, b'\x82\x01\0\x40', True),
        (b'\x82\x01\0\0', 0x800007FF, b'\x82\x01\0\x80', False),
        (b'text that is long', None, b'text that is long', True),
    ],
)
def test_comparison(data: bytes, mask: int | None, device: bytes, fits: bool) -> None:
    """Padding of expedited answers and bits that do not count make no difference."""
    assert BootWrite(0x2000, 0, data, '', mask=mask).fits(device) is fits


def test_defaults_are_of_objects_that_can_be_written() -> None:
    """What the device says by itself (statusword, identity) has no default to compare."""
    node = drive_config('joint1', 2)
    indices = {item.index for item in expected_defaults(node.dictionary)}
    assert 0x6081 in indices
    assert not indices & {0x6041, 0x1018, 0x1000}
