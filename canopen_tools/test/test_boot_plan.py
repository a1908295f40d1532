# SPDX-FileCopyrightText: 2026 The arm and quad developers
# SPDX-License-Identifier: Apache-2.0
"""One plan: what boot downloads, take-over and ``canopen diff`` compare and DCFs hold."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path

from bus_rig import VirtualNetwork
from drive_samples import bus_config, drive_config, sdo_write, with_defaults
from eds_samples import eds_text
import pytest

from arm_canopen import BusConfig, load_bus, NodeConfig, Severity
from arm_canopen.config import boot_writes, BootWrite, consumer_to_read, held_after_boot, Identity
from arm_canopen.config.model.boot_plan import WATCH_KEY
from arm_canopen.master.configuration import Configurator
from canopen_core.standard import ObjectDictionary, pdo_object
from canopen_sim.object_store import ObjectStore
from canopen_tools.cli.dcf import device_writes
from canopen_tools.cli.objects import expected_objects

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


def test_which_entries_are_read_and_which_one_is_the_masters() -> None:
    """Up to the first that is free; entry 2 belongs to the DCF."""
    for entries, taken in (
        ({1: 0}, 1),
        ({1: OTHER, 3: 0}, 3),
        ({1: OTHER, 3: 1 << 16 | 100}, 3),  # the master's, from before
        ({1: OTHER, 3: OTHER, 4: OTHER}, None),
        ({1: None}, 1),  # it cannot be read, and may be free
        ({1: OTHER, 3: None}, None),  # the EDS promises more than the device has
    ):
        scene = Scene(0)
        held: dict[int, int | None] = {}
        while (subindex := consumer_to_read(scene.config, scene.node, held)) is not None:
            held[subindex] = entries[subindex]
        assert held == entries, entries
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


def test_comparison() -> None:
    """Bits that do not count make no difference."""
    for data, mask, device, fits in (
        (b'\x05', None, b'\x05', True),
        (b'\x05', None, b'\x06', False),
        (b'\x05\0', None, b'\x05', False),
        (b'\x82\x01\0\0', 0x800007FF, b'\x82\x01\0\x40', True),
        (b'\x82\x01\0\0', 0x800007FF, b'\x82\x01\0\x80', False),
        (b'text that is long', None, b'text that is long', True),
    ):
        assert BootWrite(0x2000, 0, data, '', mask=mask).fits(device) is fits, (data, device)


NAME = 'joint'
PLACES = (0x1800, 2), (0x1800, 3), (0x1A00, 0), (0x1A00, 1), (0x2000, 0)

BUS = """
master: {node_id: 1, driver: ros2_canopen::MasterDriver, package: canopen_master_driver}
joint:
  node_id: 2
  driver: ros2_canopen::ProxyDriver
  package: canopen_proxy_driver
  dcf: device.dcf
"""
OWN_OBJECT = """
[2000]
ParameterName=Own setting
ObjectType=0x7
DataType=0x0006
AccessType=rw
DefaultValue=7
"""


def load(folder: Path, changes: dict[str, str], extra: str = '') -> BusConfig:
    """Load a bus whose device has a DCF with ParameterValues by section."""
    text = eds_text() + OWN_OBJECT
    for section, value in changes.items():
        assert f'[{section}]\n' in text, section
        text = text.replace(f'[{section}]\n', f'[{section}]\nParameterValue={value}\n')
    (folder / 'device.dcf').write_text(text)
    path = folder / 'bus.yml'
    path.write_text(BUS + extra)
    return load_bus(path)


def written(config: BusConfig) -> dict[tuple[int, int], int]:
    """Return what the DCF wants written, by index and sub-index."""
    (node,) = config.nodes
    return {
        (write.index, write.subindex): int.from_bytes(write.data, 'little')
        for write in node.parameter_writes
    }


def booted(node: NodeConfig, dictionary: ObjectDictionary) -> ObjectStore:
    """Boot a device that has the defaults of the EDS, not the values of the DCF."""
    net = VirtualNetwork(bus_config(node), dictionaries={NAME: dictionary})
    net.start()
    net.run_until(lambda: net.network.nodes[NAME].online)
    return net.devices[NAME].store


def test_a_value_that_is_not_the_default_is_written_at_boot(tmp_path: Path) -> None:
    """The device has it afterwards; bus.yml beats it."""
    (plain,) = load(tmp_path, {}).nodes
    config = load(tmp_path, {'2000': '8'})
    assert written(config) == {(0x2000, 0): 8}
    assert booted(config.nodes[0], plain.dictionary).read(0x2000) == b'\x08\x00'
    both = load(tmp_path, {'2000': '8'}, '  sdo: [{index: 0x2000, sub_index: 0, value: 9}]\n')
    assert booted(both.nodes[0], plain.dictionary).read(0x2000) == b'\x09\x00'


def test_what_another_key_configures_is_not_written_twice(tmp_path: Path) -> None:
    """Constants are compared, heartbeat and PDOs written by their own rules."""
    for section, value in (
        ('2000', '0x7'),  # the default
        ('1000', '1'),  # const
        ('1018sub1', '1'),  # identity
        ('1017', '250'),  # heartbeat
        ('1800sub2', '1'),
        ('1A00sub1', '0x60410010'),
    ):
        config = load(tmp_path, {section: value})
        assert written(config) == written(load(tmp_path, {})) == {}, section
        heartbeat = config.nodes[0].heartbeat_producer
        assert heartbeat == pytest.approx(0.25 if section == '1017' else 0.0), section


def test_commands_are_not_written_and_that_is_said(tmp_path: Path) -> None:
    """A controlword that somebody saved in a DCF must not move anything."""
    config = load(tmp_path, {'6040': '0xF', '6060': '1'})
    assert written(config) == {}
    reported = [str(warning) for warning in config.warnings if 'is a command' in warning.message]
    assert len(reported) == 2
    assert 'device.dcf' in reported[0]


def test_a_pdo_of_a_dcf_is_configured(tmp_path: Path) -> None:
    """The device has its transmission type, time and mapping after the boot.

    ``canopen dcf`` writes them and other values, and ``canopen diff`` compares them.
    """
    (plain,) = load(tmp_path, {}).nodes
    changes = {'1800sub2': '1', '1800sub3': '50', '1A00sub0': '1', '1A00sub1': '0x60410010'}
    config = load(tmp_path, changes | {'2000': '8'})
    (node,) = config.nodes
    pdo = node.tpdos[0]
    assert (pdo.configured, pdo.transmission, pdo.inhibit_time) == (True, 1, 0.005)
    assert not node.tpdos[1].configured
    store = booted(node, plain.dictionary)
    found = [store.read(*place) for place in PLACES]
    assert found == [b'\x01', b'\x32\x00', b'\x01', b'\x10\x00\x41\x60', b'\x08\x00']
    places = [(write.index, write.subindex) for write in device_writes(config, node)]
    assert (0x2000, 0) in places
    assert places.index((0x1A00, 1)) < len(places) - 1 - places[::-1].index((0x1A00, 0))
    assert {*PLACES} <= {(item.index, item.subindex) for item in expected_objects(config, node)}


def test_a_value_that_the_device_refuses_names_the_dcf(tmp_path: Path) -> None:
    """With the word to look for."""
    (plain,) = load(tmp_path, {}).nodes
    (node,) = load(tmp_path, {'2000': '8'}).nodes
    without = ObjectDictionary(entry for entry in plain.dictionary if entry.index != 0x2000)
    net = VirtualNetwork(bus_config(node), dictionaries={NAME: without})
    net.start()
    net.run_until(lambda: bool(net.reported(Severity.WARNING)))
    assert 'ParameterValue of device.dcf' in net.reported(Severity.WARNING)[0]
