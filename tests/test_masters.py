# SPDX-FileCopyrightText: 2026 The arm and quad developers
# SPDX-License-Identifier: Apache-2.0
"""Masters: led by a lifecycle manager, of two buses, and their joint states put together."""

from __future__ import annotations

from typing import TYPE_CHECKING

from bench_axes import urdf
from bus_watch import BusRecorder
from canopen_interfaces.srv import COTargetDouble
from lifecycle_msgs.msg import Transition
from lifecycle_msgs.srv import ChangeState, GetState
from processes import executable, RunningProcess
import pytest
from ros_client import RosClient
from sensor_msgs.msg import JointState
from simulated_arm import JOINTS, panda_bus, SimulatedArm

if TYPE_CHECKING:
    from pathlib import Path

    from isolation import Isolation


pytestmark = pytest.mark.scenario
NODES = ['master', *JOINTS]


@pytest.fixture
def lifecycle_bus(tmp_path: Path) -> Path:
    """The Panda's bus with lifecycle drivers."""
    text = panda_bus().read_text().replace('"@BUS_CONFIG_PATH@"', f'"{panda_bus().parent}"')
    for name in ('MasterDriver', 'Cia402Driver'):
        text = text.replace(f'::{name}', f'::Lifecycle{name}')
    path = tmp_path / 'bus.yml'
    path.write_text(text)
    return path


def change(arm: SimulatedArm, node: str, label: str) -> bool:
    """Ask for a transition by its label, as ``ros2 lifecycle set`` does."""
    request = ChangeState.Request(transition=Transition(label=label))
    return bool(arm.client.call(ChangeState, f'/{node}/change_state', request).success)


def states(arm: SimulatedArm) -> set[str]:
    """Return the states that occur among master and joints."""
    return {arm.client.call(GetState, f'/{node}/get_state').current_state.label for node in NODES}


def test_the_manager_brings_up_and_deactivation_disables(
    isolation: Isolation, lifecycle_bus: Path
) -> None:
    """Inactive nodes refuse in words; deactivated in motion, every drive stops and is off."""
    with BusRecorder(isolation.bus) as recorder, SimulatedArm(isolation, lifecycle_bus) as arm:
        assert states(arm) == {'unconfigured'}
        assert set(_said(arm, 'nodes')) == {f'/{node}' for node in ['lifecycle_manager', *NODES]}
        _said(arm, 'set', '/panda_joint1', 'configure')
        assert _said(arm, 'get', '/panda_joint1') == ['inactive [2]']
        _said(arm, 'set', '/panda_joint1', 'cleanup')
        refused = arm.client.trigger('/panda_joint1/init')
        assert not refused.success
        assert 'panda_joint1 is unconfigured, not active' in refused.message
        assert not change(arm, 'lifecycle_manager', 'activate')  # not before configure

        assert change(arm, 'lifecycle_manager', 'configure')
        assert change(arm, 'lifecycle_manager', 'activate')
        assert states(arm) == {'active'}
        arm.init_all()
        for joint in JOINTS:
            assert arm.client.trigger(f'/{joint}/position_mode').success
            assert arm.send_target(joint, 5.0).success

        assert change(arm, 'panda_joint2', 'deactivate')
        off = 'Switch on disabled'
        arm.client.spin_until(lambda: recorder.last_states()[3] == off, 20.0, 'the last frame')
        assert recorder.last_states()[2] == 'Operation enabled'
        assert not arm.client.trigger('/panda_joint2/enable').success
        assert change(arm, 'lifecycle_manager', 'deactivate')
        assert states(arm) == {'unconfigured'}
        all_off = dict.fromkeys(range(2, 9), off)
        arm.client.spin_until(lambda: recorder.last_states() == all_off, 20.0, 'the last frames')

        assert change(arm, 'lifecycle_manager', 'activate')
        arm.init_all()


def _said(arm: SimulatedArm, *words: str) -> list[str]:
    """Return what ``ros2 lifecycle`` prints."""
    process = arm.run('ros2', 'lifecycle', *words)
    assert process.wait() == 0, process.output
    return process.lines


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
            lambda: left.first_after(0.0, *target) is not None, 5.0, 'the target on the left bus'
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


def test_a_loss_is_warned_of_and_an_end_is_not(isolation: Isolation) -> None:
    """Of three publishers one goes on, one ends as a master does, and one is silent."""
    command = [executable('arm_canopen', 'canopen_joint_state_publisher'), '--ros-args']
    command += ['-p', f'robot_description:={urdf(["goes_on", "ends", "is_lost"])}']
    with RunningProcess(command, isolation.env) as process, RosClient(isolation.domain_id) as ros:
        process.wait_until_ready()
        publishers = {
            name: ros.node.create_publisher(JointState, f'/{name}/joint_states', 10)
            for name in ('goes_on', 'ends', 'is_lost')
        }
        states = ros.listen(JointState, '/joint_states')

        def publish(*names: str) -> None:
            stamp = ros.node.get_clock().now().to_msg()
            for name in names:
                message = JointState(name=[name], position=[0.5])
                message.header.stamp = stamp
                publishers[name].publish(message)

        def warned() -> bool:
            publish('goes_on')
            return 'no joint states of' in process.output

        def all_published() -> bool:
            publish(*publishers)
            return bool(states) and len(states[-1].name) == len(publishers)

        ros.spin_until(all_published, 20.0, 'all joints')
        ros.node.destroy_publisher(publishers['ends'])
        ros.spin_until(warned, 30.0, 'the warning')
        process.wait_for('no joint states of is_lost;')
