# SPDX-FileCopyrightText: 2026 The arm and quad developers
# SPDX-License-Identifier: Apache-2.0
"""One plan: what boot downloads, take-over and ``canopen diff`` compare and DCFs hold."""

from __future__ import annotations

from dataclasses import replace

from bus_rig import VirtualNetwork
from drive_samples import bus_config, drive_config, sdo_write, with_defaults
import pytest

from arm_canopen import NodeConfig
from arm_canopen.config import (
    boot_writes,
    BootWrite,
    consumer_to_read,
    held_after_boot,
    HeldConsumers,
    Identity,
)
from arm_canopen.config.model.boot_plan import WATCH_KEY
from arm_canopen.master.configuration import Configurator
from canopen_core.standard import pdo_object
from canopen_tools.cli.dcf import device_writes
from canopen_tools.cli.objects import expected_defaults, expected_objects

OTHER = 9 << 16 | 500  # an entry of 0x1016 that watches node 9


def sample_node() -> NodeConfig:
    """Return a drive for which the files configure all kinds of objects."""
    node = drive_config('joint1', 2, identity=Identity(0x20192, 0xFFFF, 0x402))
    timed = replace(node.tpdos[0], inhibit_time=0.002, event_time=0.5, transmission=255)
    fixed = replace(node.tpdos[1], fixed_mapping=True)
    disabled = replace(node.rpdos[2], enabled=False, cob_id=0)
    return replace(
        node,
        tpdos=(timed, fixed),
        rpdos=(*node.rpdos[:2], disabled),
        heartbeat_consumer=True,
        parameter_writes=(sdo_write(0x607F, 0, 30_000), sdo_write(0x1016, 2, 8 << 16 | 500)),
    )


class Scene:
    """A bus with one device, booted; its TPDO 2 is as the device has it for good."""

    def __init__(self, held: int) -> None:
        """Boot it with something in the first entry of 0x1016."""
        node = sample_node()
        mapping = node.tpdos[1].mapping
        fixed = {(0x1A01, 0): len(mapping)}
        fixed |= {(0x1A01, number): mapped.word for number, mapped in enumerate(mapping, start=1)}
        self.node = replace(node, dictionary=with_defaults(node.dictionary, fixed))  # the device
        # the bus
        self.config = bus_config(self.node, heartbeat_producer=0.2, heartbeat_timeout=0.6)
        real = with_defaults(self.node.dictionary, {(0x1016, 1): held})
        # the bus in virtual time
        self.network = VirtualNetwork(self.config, dictionaries={'joint1': real})
        self.store = self.network.devices['joint1'].store
        self.consumers = {1: held, 2: 0, 3: 0, 4: 0}  # what the device had in 0x1016 before
        self.network.boot()

    def plan(self) -> list[BootWrite]:
        """Return what boot writes to this device."""
        return boot_writes(self.config, self.node, self.consumers)

    def downloads(self) -> list[tuple[int, int, bytes]]:
        """Return what was written on the bus, one after another."""
        frames = self.network.frames(0x602)
        return [
            (data[1] | data[2] << 8, data[3], data[4 : 8 - (data[0] >> 2 & 3)])
            for data in frames
            if data[0] >> 5 == 1 and data[0] & 2
        ]

    def differences(self) -> list[str]:
        """Return what take-over would say of the device."""
        remote = self.network.network.nodes['joint1']
        configurator = Configurator(remote, self.config, on_write=lambda place: None)
        scheduler = self.network.network.scheduler
        found: list[str] = self.network.result(scheduler.spawn(configurator.differences()))
        return found


@pytest.mark.parametrize('held', [0, OTHER, 1 << 16 | 100])
def test_boot_downloads_the_plan_and_nothing_else(held: int) -> None:
    """In its order; of COB-IDs only those that are not right already, by their own rules."""
    scene = Scene(held)
    plan = scene.plan()
    wanted = [(*write.address, write.data) for write in plan if write.mask is None]
    assert (0x1016, 3 if held == OTHER else 1) in {write.address for write in plan}
    identifiers = {write.address for write in plan if write.mask is not None}
    assert [w for w in scene.downloads() if w[:2] not in identifiers] == wanted
    assert {w[:2] for w in scene.downloads()} <= {write.address for write in plan}


@pytest.mark.parametrize('held', [0, OTHER])
def test_take_over_and_diff_find_what_boot_leaves_and_every_change_of_it(held: int) -> None:
    """Mappings that a device has for good included; nothing differs right after the boot."""
    scene = Scene(held)
    kept = held_after_boot(scene.config, scene.node, scene.consumers)
    expected = expected_objects(scene.config, scene.node, scene.consumers)
    assert expected[-len(kept) :] == kept
    assert {item.address for item in expected} >= {
        (0x1000, 0),
        (0x1018, 2),
        (0x1017, 0),
        (0x60C2, 1),
    }
    assert all(item.fits(scene.store.read(*item.address)) for item in expected)
    assert scene.differences() == []
    pdos = [item for item in kept if pdo_object(item.index)]
    assert (0x1A01, 1) in {item.address for item in pdos}
    for item in pdos:
        variable = scene.store.find(*item.address)
        before = variable.value
        assert isinstance(before, int)
        variable.value = before ^ (1 if item.mask is None else item.mask & -item.mask)
        assert not item.fits(scene.store.read(*item.address))
        (found,) = scene.differences()
        assert found.startswith(item.place)
        variable.value = before


@pytest.mark.parametrize(
    ('entries', 'taken'),
    [
        ({1: 0}, 1),
        ({1: OTHER, 3: 0}, 3),
        ({1: OTHER, 3: 1 << 16 | 100}, 3),  # the master's, from before
        ({1: OTHER, 3: OTHER, 4: OTHER}, None),
        ({1: None}, 1),  # it cannot be read, and may be free
        ({1: OTHER, 3: None}, None),  # the EDS promises more than the device has
    ],
)
def test_which_entries_are_read_and_which_one_is_the_masters(
    entries: HeldConsumers, taken: int | None
) -> None:
    """Up to the first that is free; entry 2 belongs to the DCF."""
    scene = Scene(0)
    held: dict[int, int | None] = {}
    while (subindex := consumer_to_read(scene.config, scene.node, held)) is not None:
        held[subindex] = entries[subindex]
    assert held == entries
    writes = boot_writes(scene.config, scene.node, held)
    assert [w.subindex for w in writes if w.key == WATCH_KEY] == ([taken] if taken else [])


def test_a_complete_dcf_holds_the_plan() -> None:
    """Its writes are those of the plan, in its order, and lead to the same values."""
    scene = Scene(0)
    plan = boot_writes(scene.config, scene.node)
    writes = device_writes(scene.config, scene.node, complete=True)
    assert [(w.index, w.subindex) for w in writes] == [write.address for write in plan]
    last = {(w.index, w.subindex): w.data for w in writes}
    kept = held_after_boot(scene.config, scene.node)
    assert all(item.fits(last[item.address]) for item in kept if item.address in last)


@pytest.mark.parametrize(
    ('data', 'mask', 'device', 'fits'),
    [
        (b'\x05', None, b'\x05', True),
        (b'\x05', None, b'\x06', False),
        (b'\x05\0', None, b'\x05', False),
        (b'\x82\x01\0\0', 0x800007FF, b'\x82\x01\0\x40', True),
        (b'\x82\x01\0\0', 0x800007FF, b'\x82\x01\0\x80', False),
        (b'text that is long', None, b'text that is long', True),
    ],
)
def test_comparison(data: bytes, mask: int | None, device: bytes, fits: bool) -> None:
    """Bits that do not count make no difference."""
    assert BootWrite(0x2000, 0, data, '', mask=mask).fits(device) is fits


def test_defaults_are_of_objects_that_can_be_written() -> None:
    """What the device says by itself (statusword, identity) has no default to compare."""
    node = drive_config('joint1', 2)
    indices = {item.index for item in expected_defaults(node.dictionary)}
    assert 0x6081 in indices
    assert not indices & {0x6041, 0x1018, 0x1000}
