# SPDX-FileCopyrightText: 2026 The arm and quad developers
# SPDX-License-Identifier: Apache-2.0
"""Two arms on two buses, one process for their masters."""

from __future__ import annotations

from typing import TYPE_CHECKING

from bus_recorder import BusRecorder
from canopen_interfaces.srv import COTargetDouble
from processes import executable, RunningProcess
import pytest
from ros_client import RosClient
from simulated_arm import panda_bus

if TYPE_CHECKING:
    from pathlib import Path

    from isolation import Isolation

pytestmark = pytest.mark.scenario
SIDES = ('left', 'right')


def write_bus(folder: Path, side: str) -> Path:
    """Write a bus of two joints in a namespace."""
    text = panda_bus().read_text().partition('nodes:')[0]
    text = text.replace('"@BUS_CONFIG_PATH@"', f'"{panda_bus().parent}"')
    text = text.replace('  node_id: 1\n', f'  node_id: 1\n  namespace: {side}\n')
    text = text.replace('defaults:\n', f'defaults:\n  namespace: {side}\n')
    nodes = ''.join(f'  joint{n}: {{node_id: {n + 1}}}\n' for n in (1, 2))
    path = folder / f'{side}.yml'
    path.write_text(f'{text}nodes:\n{nodes}')
    return path


def program(name: str, configs: str, buses: str) -> list[str]:
    """Return the command line of an executable of arm_canopen."""
    parameters = ['-p', f'bus_config:={configs}', '-p', f'can_interface_name:={buses}']
    return [executable('arm_canopen', name), '--ros-args', *parameters]


def test_each_bus_has_its_master_in_one_process(isolation: Isolation, tmp_path: Path) -> None:
    """They boot, move and stop apart; the services are in the namespaces of their bus.yml."""
    group, port = isolation.bus.rpartition(':')[::2]
    buses = [isolation.bus, f'{group.replace(".2", ".3")}:{port}']
    configs = [write_bus(tmp_path, side) for side in SIDES]
    slaves = [
        RunningProcess(program('fake_slaves', str(config), bus), isolation.env)
        for config, bus in zip(configs, buses, strict=True)
    ]
    command = program('master', ','.join(map(str, configs)), ','.join(buses))
    with (
        slaves[0],
        slaves[1],
        BusRecorder(buses[0]) as left,
        BusRecorder(buses[1]) as right,
        RosClient(isolation.domain_id) as client,
        RunningProcess(command, isolation.env) as master,
    ):
        master.wait_for('all 2 devices operational', count=2)
        for side in SIDES:
            assert client.trigger(f'/{side}/joint1/init').success
        assert client.trigger('/left/joint1/position_mode').success
        request = COTargetDouble.Request(target=0.5)
        assert client.call(COTargetDouble, '/left/joint1/target', request).success
        target = 0x202, (500).to_bytes(4, 'little'), 3  # behind controlword and mode
        client.spin_until(
            lambda: left.first_after(0.0, *target) is not None,
            5.0,
            'the target on the left bus',
        )
        assert right.first_after(0.0, *target) is None
        assert master.stop() == 0, master.output
        for recorder in (left, right):
            assert recorder.last_states() == dict.fromkeys((2, 3), 'Switch on disabled')


def test_buses_whose_nodes_have_one_name_are_refused(isolation: Isolation, tmp_path: Path) -> None:
    """And as many interfaces as files are needed."""
    config = str(write_bus(tmp_path, 'left'))
    twice = program('master', f'{config},{config}', 'auto,auto')
    with RunningProcess(twice, isolation.env) as master:
        assert master.wait() == 1
        master.wait_for("there is a node 'left/master' on another bus already")
    with RunningProcess(program('master', config, 'a,b'), isolation.env) as master:
        assert master.wait() == 1
        master.wait_for('bus_config names 1 buses, can_interface_name 2')
