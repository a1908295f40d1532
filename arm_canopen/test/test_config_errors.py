# SPDX-FileCopyrightText: 2026 The arm and quad developers
# SPDX-License-Identifier: Apache-2.0
"""Single keys that are refused in a bus.yml."""

from __future__ import annotations

from pathlib import Path

from config_cases import Case, check
from config_samples import eds_text
import pytest

SCALARS = [
    Case('joint1', 'nod_id: 3 # <-', 'nod_id', "unknown key 'nod_id'", "'node_id'"),
    Case('joint1', 'colour: red # <-', 'colour', 'unknown key', 'known here: node_id'),
    Case('joint1', 'sync_period: 5 # <-', 'sync_period', 'unknown', 'to master;'),
    Case('joint1', 'options: {} # <-', 'options', 'unknown', 'belongs to the top level'),
    Case('joint1', 'node_id: 0 # <-', 'node_id', '0 is out of range', '1 to 127'),
    Case('joint1', 'node_id: 255 # <-', 'node_id', '255 is out of range', '1 to 127'),
    Case('joint1', 'node_id: two # <-', 'node_id', "whole number, got 'two'", '0x0A'),
    Case('joint1', 'node_id: 010 # <-', 'node_id', '010 is ambiguous', 'write 10'),
    Case('joint1', 'node_id: 1:30 # <-', 'node_id', 'base 60', 'plain number'),
    Case('joint1', 'node_id: 2.5 # <-', 'node_id', 'got 2.5', 'write it as'),
    Case('joint1', 'node_id: # <-', 'node_id', 'got nothing', 'behind the key'),
    Case('joint1', 'node_id: [2] # <-', 'node_id', 'got a list', 'behind the key'),
    Case('joint1', 'node_id: off # <-', 'node_id', 'reads it as a boolean', '0x0A'),
    Case('joint1', 'mandatory: maybe # <-', 'mandatory', "got 'maybe'", 'true or false'),
    Case('joint1', 'mandatory: "false" # <-', 'mandatory', 'false', 'without quotes'),
    Case('joint1', 'namespace: on # <-', 'namespace', 'as a boolean', 'quotes'),
    Case('joint1', 'namespace: a b # <-', 'namespace', 'no ROS namespace', '/left/arm'),
    Case('joint1', 'remappings: {a: 1} # <-', 'remappings.a', 'got 1', 'quotes'),
    Case('joint1', 'remappings: x # <-', 'remappings', 'keys with values', 'indent'),
    Case('joint1', 'scale_pos_to_dev: 0 # <-', 'scale_pos_to_dev', '0 is out', 'than 0'),
    Case('joint1', 'scale_vel_to_dev: .nan # <-', 'scale_vel_to_dev', r'\.nan', '0.5'),
    Case('joint1', 'offset_pos_to_dev: inf # <-', 'offset_pos_to_dev', 'finite', 'one'),
    Case('joint1', 'switching_state: 7 # <-', 'switching_state', '7', '5 Operation ena'),
    Case('joint1', 'position_mode: 3 # <-', 'position_mode', '3 is', '8 Cyclic posit'),
    Case('joint1', 'velocity_mode: 8 # <-', 'velocity_mode', '8 is', '3 Profile velo'),
    Case('joint1', 'period: 0 # <-', 'period', '0 is out of range', '1 to 60000'),
    Case('joint1', 'boot_timeout_ms: -1 # <-', 'boot_timeout_ms', '-1', '1 to 600000'),
    Case(
        'joint1',
        'heartbeat_producer: 70000 # <-',
        'heartbeat_producer',
        '70000 is out of range',
        '0 to 65535',
    ),
    Case(
        'joint1',
        'heartbeat_multiplier: 0.5 # <-',
        'heartbeat_multiplier',
        '0.5 is out of range',
        'below 1 every heartbeat',
    ),
    Case('master', 'node_id: 200 # <-', 'node_id', '200 is out of range', '1 to 127'),
    Case('master', 'sync_period: 10 # <-', 'sync_period', '10 is out', '10 ms is 10000'),
    Case('master', 'sync_overflow: 1 # <-', 'sync_overflow', '1 is out', '0 or 2 to 240'),
    Case('master', 'baudrate: 42 # <-', 'baudrate', '42 is not allowed', '500 kbit/s'),
    Case('master', 'baud_rate: 500 # <-', 'baud_rate', 'unknown', "mean 'baudrate'"),
    Case(
        'master',
        'heartbeat_producer: 60000 # <-',
        'heartbeat_producer',
        'is 180 s, devices wait at most 65.535 s',
        'smaller',
    ),
    Case('defaults', 'perod: 10 # <-', 'perod', "unknown key 'perod'", "mean 'period'"),
    Case('top', 'option: {dcf_path: "."} # <-', 'option', 'unknown section', "mean 'options'"),
    Case('top', 'joint2: {node_id: 3} # <-', 'joint2', 'unknown section', "below 'nodes:'"),
    Case('top', 'options: [] # <-', 'options', 'got a list', 'indent the keys'),
    Case(
        'top',
        'options: {heartbeat_multiplier: x} # <-',
        'options.heartbeat_multiplier',
        "'x'",
        '10',
    ),
]

DRIVERS = [
    Case(
        'joint1',
        'driver: "ros2_canopen::CIA402Driver" # <-',
        'driver',
        'unknown driver class',
        "mean 'ros2_canopen::Cia402Driver'",
    ),
    Case(
        'joint1',
        'driver: "ros2_canopen::MasterDriver" # <-',
        'driver',
        'unknown driver class',
        'for the master',
    ),
    Case(
        'master',
        'driver: "ros2_canopen::ProxyDriver" # <-',
        'driver',
        'unknown driver class',
        "for devices; take 'ros2_canopen::MasterDriver'",
    ),
    Case('joint1', 'driver: Rocket # <-', 'driver', "'Rocket'", 'ProxyDriver'),
]

REFUSED = [
    Case('joint1', 'num_channels: 2 # <-', 'num_channels', 'has 1 of 2 axes', 'use the EDS'),
    Case('joint1', 'num_channels: 9 # <-', 'num_channels', 'out of range', '8 axes'),
    Case('joint1', 'channels: [] # <-', 'channels', '0 entries for 1 channels', 'as many'),
    Case('joint1', 'channel_names: [a, b] # <-', 'channel_names', '2 names for 1', 'as many'),
    Case(
        'joint1', 'recovery: always # <-', 'recovery', "unknown policy 'always'", 'manual or auto'
    ),
    Case(
        'joint1',
        'driver: "ros2_canopen::LifecycleCia402Driver" # <-',
        'driver',
        'is a lifecycle driver, but the master has a plain one',
        'for all or for none',
    ),
    Case('joint1', 'software_file: x # <-', 'software_file', 'vendor', 'remove'),
    Case('joint1', 'software_version: 1 # <-', 'software_version', 'not chec', 'remove'),
    Case(
        'joint1',
        'restore_configuration: 128 # <-',
        'restore_configuration',
        'out of range',
        '0 to 127',
    ),
    Case(
        'joint1',
        'configuration_file: x.bin # <-',
        'configuration_file',
        'sdo list',
        'remove',
    ),
]


@pytest.mark.parametrize('case', SCALARS + DRIVERS + REFUSED, ids=lambda case: case.piece.strip())
def test_wrong_keys_are_refused(tmp_path: Path, case: Case) -> None:
    """Each is reported with its line, key, the value and what to write instead."""
    check(tmp_path, case)


FILES = [
    Case(
        'joint1',
        'dcf: other.eds # <-',
        'dcf',
        "no EDS 'other.eds'; looked for",
        'put',
    ),
    Case('joint1', 'dcf: 5 # <-', 'dcf', 'expected a text, got 5', "'5'"),
    Case(
        'joint1',
        'dcf: $NOT_A_VARIABLE/x.eds # <-',
        'dcf',
        r'there is no EDS .\$NOT_A_VARIABLE/x.eds',
        'environment variable',
    ),
    Case(
        'joint1',
        'heartbeat_consumer: true # <-\nheartbeat_multiplier: 2',
        'heartbeat_consumer',
        'cannot watch the master: no writable 0x1016:01',
        'EDS that fits',
    ),
    Case(
        'joint1',
        'heartbeat_producer: 100 # <-',
        'heartbeat_producer',
        'no heartbeat: 0x1017 is not in its EDS',
        'EDS that fits',
    ),
]


@pytest.mark.parametrize('case', FILES, ids=lambda case: case.piece)
def test_what_the_eds_lacks_is_refused(tmp_path: Path, case: Case) -> None:
    """A missing EDS or object is reported at the key that wants it."""
    eds = eds_text().replace('[1016', '[2F16').replace('[1017', '[2F17')
    check(tmp_path, case, eds=eds)
