# SPDX-FileCopyrightText: 2026 The arm and quad developers
# SPDX-License-Identifier: Apache-2.0
"""Bus names: which bus they mean, and which mean none."""

from __future__ import annotations

import itertools
import logging
import os
import subprocess
import sys

from can_addresses import free_virtual
import pytest

from canopen_core import BusError
from canopen_core.can import (
    CanInterface,
    Frame,
    open_bus,
    opening,
    resolve_name,
)

MULTICAST = f'udp_multicast:239.74.7.2:{43113 + os.getuid() % 10_000}'


@pytest.mark.parametrize(
    ('interfaces', 'expected'),
    [
        ({}, MULTICAST),
        ({'vcan0': CanInterface('vcan0', is_up=True, queue_length=1000)}, 'vcan0'),
        (
            {'vcan0': CanInterface('vcan0', is_up=False, queue_length=1000)},
            MULTICAST,
        ),
        (
            {'can0': CanInterface('can0', is_up=True, queue_length=10)},
            MULTICAST,
        ),
    ],
    ids=['none', 'vcan0', 'vcan0 down', 'real can0'],
)
def test_auto_takes_vcan0_when_it_is_up_and_never_real_hardware(
    monkeypatch: pytest.MonkeyPatch, interfaces: dict[str, CanInterface], expected: str
) -> None:
    """Without a name nothing real is ever driven."""
    monkeypatch.setattr(opening, 'can_interfaces', lambda: interfaces)
    monkeypatch.setenv('ROS_DOMAIN_ID', '7')
    assert resolve_name('auto') == expected


def test_users_and_domains_have_buses_of_their_own(monkeypatch: pytest.MonkeyPatch) -> None:
    """And further ones for further robots: no two of them are the same."""
    monkeypatch.setattr(opening, 'can_interfaces', dict)
    names: list[str] = []
    for user in (0, 1000, 1001):
        monkeypatch.setattr(os, 'getuid', lambda user=user: user)
        for domain in ('', '1', '232'):
            monkeypatch.setenv('ROS_DOMAIN_ID', domain)
            assert resolve_name('auto') == resolve_name('auto')
            names += itertools.islice(opening.auto_names(), 3)
    assert len(set(names)) == len(names)
    for name in names:
        with open_bus(name) as bus:
            assert bus.name == name


def test_auto_says_which_bus_it_took(
    monkeypatch: pytest.MonkeyPatch, caplog: pytest.LogCaptureFixture
) -> None:
    """The choice is logged, and the bus has the name of what was chosen."""
    chosen = free_virtual()
    monkeypatch.setattr(opening, 'resolve_name', lambda name: chosen)
    with caplog.at_level(logging.INFO), open_bus('auto') as bus:
        assert bus.name == chosen
    assert f'auto is {chosen}' in caplog.text


@pytest.mark.parametrize('name', ['can0', 'udp_multicast', 'virtual:x', 'pcan:X@500000'])
def test_other_names_mean_themselves(name: str) -> None:
    """Only auto is a choice."""
    assert resolve_name(name) == name


@pytest.mark.parametrize('name', ['', ':', ':x', 'virtual:', 'pcan:'])
def test_names_of_nothing_are_refused(name: str) -> None:
    """An empty kind or channel names no bus, and the message says what would."""
    with pytest.raises(BusError, match='take can0, vcan0, udp_multicast or auto'):
        open_bus(name)


def test_virtual_buses_of_different_names_do_not_meet() -> None:
    """Two channels in one process are two wires, and one of the same name is one."""
    name = free_virtual()
    with open_bus(name) as one, open_bus(name) as two, open_bus(free_virtual()) as apart:
        one.send(Frame(1))
        assert len(two.receive(0.0)) == 1
        assert apart.receive(0.0) == []


def test_a_virtual_bus_that_nobody_reads_loses_and_counts(monkeypatch: pytest.MonkeyPatch) -> None:
    """Its queue has an end, so a forgotten bus does not fill the memory."""
    monkeypatch.setattr('canopen_core.can.bus.QUEUE_FRAMES', 10)
    name = free_virtual()
    with open_bus(name) as sender, open_bus(name) as idle:
        for number in range(15):
            sender.send(Frame(number))
        assert idle.counters.lost == 5
        assert [frame.can_id for frame in idle.receive(0.0)] == list(range(10))


def test_opening_a_bus_of_ours_does_not_import_python_can() -> None:
    """python-can takes longer to import than a slave to start; only its adapters pay."""
    program = (
        'import sys; from canopen_core.can import open_bus; open_bus("virtual:x").close(); '
        'open_bus("udp_multicast:239.127.1.2:20199").close(); sys.exit("can" in sys.modules)'
    )
    subprocess.run(
        [sys.executable, '-c', program],
        check=True,
        timeout=60,
        env={'PYTHONPATH': ':'.join(sys.path)},
    )
