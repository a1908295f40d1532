# SPDX-FileCopyrightText: 2026 The arm and quad developers
# SPDX-License-Identifier: Apache-2.0
"""The ParameterValues of a DCF: what is written of them, and what is not."""

from __future__ import annotations

from pathlib import Path

from bus_rig import VirtualNetwork
from drive_samples import bus_config
from eds_samples import eds_text
import pytest

from arm_canopen import BusConfig, load_bus, NodeConfig, Severity
from canopen_core.standard import ObjectDictionary
from canopen_tools.cli.dcf import device_writes
from canopen_tools.cli.objects import expected_objects

NAME = 'joint'
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


def load(folder: Path, changes: dict[str, str], extra: str = '', bus: str = '') -> BusConfig:
    """Load a bus whose device has a DCF with ParameterValues by section."""
    text = eds_text() + OWN_OBJECT
    for section, value in changes.items():
        assert f'[{section}]\n' in text, section
        text = text.replace(f'[{section}]\n', f'[{section}]\nParameterValue={value}\n')
    (folder / 'device.dcf').write_text(text)
    path = folder / 'bus.yml'
    path.write_text(BUS + bus + extra)
    return load_bus(path)


def written(config: BusConfig) -> dict[tuple[int, int], int]:
    """Return what the DCF wants written, by index and sub-index."""
    (node,) = config.nodes
    return {
        (write.index, write.subindex): int.from_bytes(write.data, 'little')
        for write in node.parameter_writes
    }


def booted(node: NodeConfig, dictionary: ObjectDictionary) -> VirtualNetwork:
    """Boot a device that has the defaults of the EDS, not the values of the DCF."""
    net = VirtualNetwork(bus_config(node), dictionaries={NAME: dictionary})
    net.start()
    net.run_until(lambda: net.network.nodes[NAME].online)
    return net


def test_a_value_that_is_not_the_default_is_written_at_boot(tmp_path: Path) -> None:
    """The device has it afterwards; bus.yml beats it."""
    (plain,) = load(tmp_path, {}).nodes
    config = load(tmp_path, {'2000': '8'})
    assert written(config) == {(0x2000, 0): 8}
    net = booted(config.nodes[0], plain.dictionary)
    assert net.devices[NAME].store.read(0x2000) == b'\x08\x00'
    both = load(tmp_path, {'2000': '8'}, '  sdo: [{index: 0x2000, sub_index: 0, value: 9}]\n')
    net = booted(both.nodes[0], plain.dictionary)
    assert net.devices[NAME].store.read(0x2000) == b'\x09\x00'


def test_an_eds_and_a_default_write_nothing(tmp_path: Path) -> None:
    """A ParameterValue that is the DefaultValue costs no time at boot."""
    assert written(load(tmp_path, {})) == {}
    assert written(load(tmp_path, {'2000': '0x7'})) == {}


@pytest.mark.parametrize(
    'section',
    ['1000', '1018sub1', '1017', '1800sub2', '1A00sub1'],
    ids=['const', 'identity', 'heartbeat', 'pdo', 'mapping'],
)
def test_what_another_key_configures_is_not_written_twice(tmp_path: Path, section: str) -> None:
    """Constants are compared, heartbeat and PDOs written by their own rules."""
    config = load(tmp_path, {section: '1' if section != '1A00sub1' else '0x60410010'})
    assert written(config) == {}


def test_commands_are_not_written_and_that_is_said(tmp_path: Path) -> None:
    """A controlword that somebody saved in a DCF must not move anything."""
    config = load(tmp_path, {'6040': '0xF', '6060': '1'})
    assert written(config) == {}
    reported = [str(warning) for warning in config.warnings if 'is a command' in warning.message]
    assert len(reported) == 2
    assert 'device.dcf' in reported[0]


def test_the_heartbeat_of_a_dcf_counts(tmp_path: Path) -> None:
    """It is what the device shall have where bus.yml says nothing."""
    (node,) = load(tmp_path, {'1017': '250'}).nodes
    assert node.heartbeat_producer == pytest.approx(0.25)


def test_a_pdo_of_a_dcf_is_configured(tmp_path: Path) -> None:
    """The device has its transmission type, time and mapping after the boot."""
    (plain,) = load(tmp_path, {}).nodes
    changes = {
        '1800sub2': '1',
        '1800sub3': '50',
        '1A00sub0': '1',
        '1A00sub1': '0x60410010',
    }
    (node,) = load(tmp_path, changes).nodes
    pdo = node.tpdos[0]
    assert (pdo.configured, pdo.transmission, pdo.inhibit_time) == (True, 1, 0.005)
    assert not node.tpdos[1].configured
    store = booted(node, plain.dictionary).devices[NAME].store
    assert store.read(0x1800, 2) == b'\x01'
    assert store.read(0x1800, 3) == b'\x32\x00'
    assert store.read(0x1A00, 0) == b'\x01'
    assert store.read(0x1A00, 1) == b'\x10\x00\x41\x60'


def test_a_value_that_the_device_refuses_names_the_dcf(tmp_path: Path) -> None:
    """Whoever reads the message finds the file and the word to look for."""
    (plain,) = load(tmp_path, {}).nodes
    (node,) = load(tmp_path, {'2000': '8'}).nodes
    without = ObjectDictionary(entry for entry in plain.dictionary if entry.index != 0x2000)
    net = VirtualNetwork(bus_config(node), dictionaries={NAME: without})
    net.start()
    net.run_until(lambda: bool(net.reported(Severity.WARNING)))
    assert 'ParameterValue of device.dcf' in net.reported(Severity.WARNING)[0]


def test_the_other_tools_know_them_too(tmp_path: Path) -> None:
    """``canopen dcf`` writes them, PDO mapping included, and ``canopen diff`` compares them."""
    changes = {'2000': '8', '1A00sub0': '1', '1A00sub1': '0x60410010', '1800sub2': '1'}
    config = load(tmp_path, changes)
    (node,) = config.nodes
    writes = device_writes(config, node)
    places = [(write.index, write.subindex) for write in writes]
    assert (0x2000, 0) in places
    assert places.index((0x1A00, 1)) < len(places) - 1 - places[::-1].index((0x1A00, 0))
    assert {(0x2000, 0), (0x1800, 2), (0x1A00, 1)} <= {
        (item.index, item.subindex) for item in expected_objects(config, node)
    }
