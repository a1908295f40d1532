# SPDX-FileCopyrightText: 2026 The arm and quad developers
# SPDX-License-Identifier: Apache-2.0
"""docs/other_clients.md, typed from its top to its end, and clients of PyPI and npm unedited."""

from __future__ import annotations

from collections.abc import Sequence
from contextlib import ExitStack, suppress
import json
import os
from pathlib import Path
import re
import shutil
import subprocess
import sys

import can
from isolation import Isolation
from manual_page import CHECKOUT, commands, line_pattern
from mcap.reader import make_reader
from processes import RunningProcess
import pytest

from quad_sim import ServedRobot

pytestmark = [pytest.mark.scenario, pytest.mark.slow, pytest.mark.timeout(1200)]

PAGE = CHECKOUT / 'docs' / 'other_clients.md'
TIMEOUT = 180.0  # [s] of a command, on a busy machine
INSTALLING = 600.0  # [s] of one that gets packages, there
INSTALL = re.compile(r'python3 -m venv (\S+) && \S+ install')
BY_UV = rf'uv venv --quiet --python {sys.executable} \1 && uv pip install --python \1'
NO_NETWORK = (  # in the words of uv and npm
    *('dns error', 'Failed to fetch', 'connect error', 'client error'),
    'EAI_AGAIN',
    'ENOTFOUND',
    'ECONNREFUSED',
)


def test_the_page_is_typed_from_top_to_end(isolation: Isolation, tmp_path: Path) -> None:
    """Each block; what its commands print is what the page shows (as missing_in_run does).

    Packages are installed by uv, which needs a tenth of the time: both robots run meanwhile.
    """
    env = isolation.env | {'HOME': str(tmp_path)}
    cache = subprocess.run(['uv', 'cache', 'dir'], check=True, capture_output=True, text=True)
    env['UV_CACHE_DIR'] = cache.stdout.strip()
    with ExitStack() as stack:
        for command in commands(PAGE):
            text = command.text.removesuffix('&').replace(' auto ', f' {isolation.bus} ')
            stays = text != command.text or ' bringup ' in text
            text = INSTALL.sub(BY_UV, text)
            if 'bringup panda' in text:
                text += f' --can {isolation.bus}'
            shell = ['bash', '-c', f'cd {CHECKOUT} && {text}']
            process = stack.enter_context(RunningProcess(shell, env))
            if stays:
                for shown in command.shown:
                    if shown.strip() not in {'', '...'}:
                        process.wait_for(line_pattern(shown).pattern, TIMEOUT)
                continue
            code = process.wait(INSTALLING if ' install ' in text else TIMEOUT)
            if code and any(words in process.output for words in NO_NETWORK):
                pytest.skip(f'PyPI cannot be reached: {process.lines[-1]}')
            ended = {0, 124} if text.startswith('timeout') else {0}
            assert code in ended, f'{text}\n{process.output}'
            assert not command.missing(process.lines), f'{text}\n{process.output}'
    with (tmp_path / 'words' / 'words_0.mcap').open('rb') as stream:
        summary = make_reader(stream).get_summary()
    assert summary is not None
    (channel,) = summary.channels.values()
    assert channel.metadata['topic_type_hash'] == ''


# Each of the following brings what it needs into a folder of its own; python-canopen is in the
# tests of canopen_sim, MoveGroupInterface's calls in those of arm_planning.
PYMOVEIT2 = """
import os
import sys
import threading
import time

from pymoveit2 import MoveIt2
from pymoveit2.robots import panda
import rclpy
from rclpy.callback_groups import ReentrantCallbackGroup
from rclpy.executors import MultiThreadedExecutor

rclpy.init()
node = rclpy.create_node('client')
arm = MoveIt2(
    node=node, joint_names=panda.joint_names(), base_link_name=panda.base_link_name(),
    end_effector_name=panda.end_effector_name(), group_name='panda_arm',
    use_move_group_action=True, callback_group=ReentrantCallbackGroup(),
)
executor = MultiThreadedExecutor(2)
executor.add_node(node)
threading.Thread(target=executor.spin, daemon=True).start()
time.sleep(2.0)
for motion in range(20):
    d = 0.01 if motion % 2 else -0.01
    arm.move_to_configuration([d, -0.785 + d, d, -2.356, d, 1.571, 0.785])
    arm.wait_until_executed()
    print('motion', motion, flush=True)
os._exit(0)
"""
DURAND = """
import sys
import time

import can
from durand import CANBusNetwork, DatatypeEnum, MinimalNode, Variable

node = MinimalNode(CANBusNetwork(can.Bus(interface='arm_canopen', channel=sys.argv[1])), 10)
node.object_dictionary[0x2000] = Variable(DatatypeEnum.UNSIGNED32, 'rw', 7, name='Parameter')
print('ready', flush=True)
time.sleep(600.0)
"""
NODE_CANOPEN = """
const { DataType, Device } = require('canopen');
const device = new Device({ id: 0x7E }), server = 2;
device.addListener('message', (m) => console.log(JSON.stringify([m.id, [...m.data]])));
require('readline').createInterface({ input: process.stdin }).on('line', (line) => {
    const [id, data] = JSON.parse(line);
    device.receive({ id, data: Buffer.from(data) });
});
device.eds.addSdoClientParameter(server, 0x600 + server, 0x580 + server);
device.start();
const at = { serverId: server, index: 0x6083, dataType: DataType.UNSIGNED32, timeout: 5000 };
device.sdo.download({ ...at, data: 4711 })
    .then(() => device.sdo.upload(at))
    .then((value) => console.error('value', value), (error) => console.error('failed', error))
    .then(() => process.exit(0));
"""
XGOLIB = """
import sys
import time

from xgolib import XGO_DOG

dog = XGO_DOG(sys.argv[1], version='xgolite')
print(dog.read_firmware(), dog.read_battery(), len(dog.read_motor()), flush=True)
dog.move_x(15)
time.sleep(2.0)
dog.stop()
print('tilt', abs(dog.read_roll()) < 15.0, abs(dog.read_pitch()) < 15.0, flush=True)
"""


MUJOCO = """
import sys

import mujoco

model = mujoco.MjModel.from_xml_path(sys.argv[1])
data = mujoco.MjData(model)
mujoco.mj_resetDataKeyframe(model, data, model.key('stand').id)
mujoco.mj_step(model, data, 200)
print(mujoco.__version__, *data.qpos)
"""
DCFCHK = 'from dcf.cli import main; main()'


def installed(command: Sequence[str | Path], folder: Path) -> Path:
    """Install pinned packages into a folder; skip the test where no registry can be reached."""
    done = subprocess.run(
        command, check=False, capture_output=True, text=True, timeout=INSTALLING, cwd=folder
    )
    if done.returncode and any(words in done.stderr for words in NO_NETWORK):
        pytest.skip(f'no registry can be reached: {done.stderr.splitlines()[-1]}')
    assert done.returncode == 0, done.stderr
    return folder


def from_pypi(package: str, folder: Path) -> dict[str, str]:
    """Install a package without what it requires; return what finds it."""
    uv = f'uv pip install --quiet --python {sys.executable} --no-deps --target'.split()
    installed([*uv, folder, package], folder)
    return {'PYTHONPATH': f'{folder}:{os.environ.get("PYTHONPATH", "")}'}


def test_pymoveit2(isolation: Isolation, tmp_path: Path) -> None:
    """Rclpy drops answers that come early; without a second one a motion would never end."""
    env = isolation.env | from_pypi('pymoveit2==5.0.0', tmp_path)
    bringup = ['ros2', 'run', 'arm_bringup', 'bringup', 'panda', '--simulate', '--enable']
    bringup += ['--plan', '--can', isolation.bus]
    with RunningProcess(bringup, env) as robot:
        robot.wait_for('drives are enabled', TIMEOUT)
        with RunningProcess([sys.executable, '-c', PYMOVEIT2], env) as client:
            client.wait_for('motion 19', TIMEOUT)


def test_durand(isolation: Isolation, tmp_path: Path) -> None:
    """A device by others: found, read, written, and its EDS read from it by block transfer."""
    env = isolation.env | from_pypi('durand==0.5.0', tmp_path)
    tool = ['ros2', 'run', 'canopen_tools', 'canopen']
    with RunningProcess([sys.executable, '-c', DURAND, isolation.bus], env) as device:
        device.wait_for('ready', TIMEOUT)
        for arguments, printed in (
            (['scan', '--can', isolation.bus], r'\b10\b'),
            (['write', '--can', isolation.bus, '10', '0x2000', '4711', '--type', 'u32'], ''),
            (['read', '--can', isolation.bus, '10', '0x2000', '--type', 'u32'], '4711'),
            (['read', '--can', isolation.bus, '10', '0x1021', '--type', 'text'], 'FileInfo'),
        ):
            with RunningProcess([*tool, *arguments], env) as command:
                assert command.wait(TIMEOUT) == 0, command.output
                assert re.search(printed, command.output), command.output


def test_canopen_of_npm(isolation: Isolation, tmp_path: Path) -> None:
    """Its client writes and reads an object of a simulated drive; frames go through pipes."""
    if shutil.which('npm') is None:
        pytest.skip('npm is not installed')
    installed(['npm', 'install', '--silent', '--prefix', tmp_path, 'canopen@6.2.1'], tmp_path)
    (tmp_path / 'client.js').write_text(NODE_CANOPEN, encoding='utf-8')
    drive = ['ros2', 'run', 'canopen_sim', 'fake_slave', '--ros-args', '-p', 'node_id:=2', '-p']
    with ExitStack() as stack:
        robot = stack.enter_context(
            RunningProcess([*drive, f'can_interface_name:={isolation.bus}'], isolation.env)
        )
        robot.wait_for('simulated drive 2', TIMEOUT)
        bus = stack.enter_context(can.Bus(interface='arm_canopen', channel=isolation.bus))
        client = stack.enter_context(
            subprocess.Popen(
                ['node', 'client.js'],
                cwd=tmp_path,
                stdin=subprocess.PIPE,
                stdout=subprocess.PIPE,
                stderr=subprocess.PIPE,
                text=True,
                bufsize=1,
            )
        )
        assert client.stdin is not None
        assert client.stdout is not None
        assert client.stderr is not None
        deliver = client.stdin

        def to_client(message: can.Message) -> None:
            with suppress(BrokenPipeError, ValueError):
                deliver.write(f'[{message.arbitration_id}, {list(message.data)}]\n')

        notifier = can.Notifier(bus, [to_client])
        for line in client.stdout:
            identifier, data = json.loads(line)
            bus.send(can.Message(arbitration_id=identifier, data=data, is_extended_id=False))
        notifier.stop()
        assert client.stderr.read().strip() == 'value 4711'


def test_xgolib(isolation: Isolation, tmp_path: Path) -> None:
    """The vendor's library walks the simulated robot."""
    env = isolation.env | from_pypi('xgolib==1.1.10', tmp_path)
    with (
        ServedRobot('--protocol', 'v1') as robot,
        RunningProcess([sys.executable, '-c', XGOLIB, robot.port], env) as vendor,
    ):
        assert vendor.wait(TIMEOUT) == 0, vendor.output
        assert re.search(r'^L\S* \d+ 1[25]$', vendor.output, re.MULTILINE), vendor.output
        assert 'tilt True True' in vendor.output


def test_dcf_tools(isolation: Isolation, tmp_path: Path) -> None:
    """The checker of Lely's own tools finds nothing in a master.dcf."""
    env = isolation.env | from_pypi('dcf-tools==2.4.2', tmp_path)
    bus = CHECKOUT / 'arm_bringup' / 'robots' / 'gp110' / 'bus.yml'
    export = ['ros2', 'run', 'canopen_tools', 'canopen', 'dcf', str(bus), '--out', str(tmp_path)]
    for command in (export, [sys.executable, '-c', DCFCHK, str(tmp_path / 'master.dcf')]):
        done = subprocess.run(
            command, check=False, capture_output=True, text=True, timeout=TIMEOUT, env=env
        )
        assert done.returncode == 0, done.stderr
    assert not done.stderr


def test_mujoco_of_the_major_version_before(isolation: Isolation, tmp_path: Path) -> None:
    """The exported robot moves in it as in the one that is installed here."""
    earlier = isolation.env | from_pypi('mujoco==3.17.0', tmp_path)
    model = tmp_path / 'xgo.xml'
    export = ['ros2', 'run', 'quad_sim', 'export_mjcf', str(model), '--floor']
    subprocess.run(export, check=True, timeout=TIMEOUT, env=isolation.env)
    (old, *before), (new, *now) = (
        subprocess.run(
            [sys.executable, '-c', MUJOCO, model],
            check=True,
            capture_output=True,
            text=True,
            timeout=TIMEOUT,
            env=env,
        ).stdout.split()
        for env in (earlier, isolation.env)
    )
    assert old == '3.17.0' != new
    assert [float(each) for each in before] == pytest.approx([float(each) for each in now])
