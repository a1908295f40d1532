# SPDX-FileCopyrightText: 2026 The arm and quad developers
# SPDX-License-Identifier: Apache-2.0
"""The bring-up with small processes in place of the real ones, and what it proposes."""

from __future__ import annotations

from pathlib import Path
import re
import shutil
import signal
import subprocess

from isolation import Isolation
import pytest
from small_bringup import read_until, SmallWorkspace
from small_processes import TIMEOUT

from arm_bringup import bringup
from arm_bringup.bringup import next_commands
from arm_bringup.examples.wave import main as demo
from process_supervisor import RosOptions

DRIVES, MODE = ['shoulder', 'elbow'], 'cyclic_position_mode'


def test_what_comes_next_is_proposed() -> None:
    """In its namespace; nothing is enabled by hand, or the services of each drive come first.

    A target is absolute, so no arm on hardware gets one proposed.
    """
    arm, first = ['arm_controller'], '/shoulder/init std_srvs/srv/Trigger # and of the others'
    target = 'ros2 service call /shoulder/target canopen_interfaces/srv/COTargetDouble'
    for namespace, controllers, flags, lines in (
        ('left', arm, 'enabled', ['/left/arm_controller/follow_joint_traj', '-r __ns:=/left']),
        ('', arm, 'simulated planned', [first, '--enable enables', '/move_action']),
        ('', [], 'enabled simulated', [target, '{ target: 0.1 }', '/joint_states']),
        ('', [], 'enabled', ['echo --once /joint_states']),
    ):
        fields = {name: name in flags for name in ('enabled', 'simulated', 'planned')}
        text = next_commands(DRIVES, MODE, controllers, RosOptions(namespace), **fields)
        assert text.startswith('in a second terminal')
        assert [line for line in lines if line not in text] == [], text
        assert ('/init' in text) == (not fields['enabled'])
        assert ('/target' in text) == (fields['simulated'] and not controllers)
        assert ('servo_keyboard' in text) == bool(controllers)
        assert ('/move_action' in text) == fields['planned']


PANDA = Path(__file__).parents[1] / 'robots' / 'panda'

LINES = {
    ('canopen_sim', 'fake_slaves'): '[INFO] [fake_slaves]: 7 simulated drives on '
    '{can_interface_name}',
    ('arm_canopen', 'master'): '[INFO] [master]: all 7 devices operational',
}


@pytest.fixture
def workspace(tmp_path: Path, prefix: Path, isolation: Isolation) -> SmallWorkspace:
    """Install the small programs, in a ROS domain of their own."""
    libraries = ('libraries/recording', 'libraries/robot_primitives', 'libraries/ros_runtime')
    sources = ('arm_bringup', 'arm_canopen', 'canopen_core', 'canopen_sim', *libraries)
    workspace = SmallWorkspace(tmp_path, 'arm_bringup', LINES, sources, [prefix])
    workspace.environment['ROS_DOMAIN_ID'] = str(isolation.domain_id)
    return workspace


def ended(process: subprocess.Popen[str], sent: signal.Signals = signal.SIGINT) -> str:
    """End a bring-up; return what it has said since."""
    process.send_signal(sent)
    rest, _ = process.communicate(timeout=TIMEOUT)
    assert process.returncode == 0, rest
    return rest


@pytest.mark.slow
def test_ctrl_c_ends_it_with_0_after_the_master_and_the_slaves(
    workspace: SmallWorkspace,
) -> None:
    """Every process says good-bye in its turn; nothing is left in the temporary folder."""
    with workspace.bringup('panda', '--simulate', '--can', 'auto') as process:
        seen = read_until(process, 'all is ready')
        rest = ended(process)
    assert 'panda on CAN bus udp_multicast' in seen
    assert '    ros2 service call /panda_joint1/target canopen_interfaces' in seen
    byes = [line.split()[0] for line in rest.splitlines() if line.endswith('| bye')]
    assert byes == ['master', 'slaves']
    assert list(workspace.folder.glob('arm_bringup-*/')) == []
    # hardware is on can0, and no slaves are started: the master would find two drives for each
    with workspace.bringup('panda') as process:
        seen = read_until(process, 'all is ready')
        ended(process, signal.SIGTERM)
    assert 'panda on CAN bus can0' in seen
    assert 'slaves' not in seen
    assert 'ros2 service call /panda_joint1/init' in seen
    assert '/target' not in seen, 'it is absolute: nothing for an arm that is anywhere'


@pytest.mark.slow
def test_what_cannot_start_ends_it(workspace: SmallWorkspace) -> None:
    """A master that does not get ready, after the time-out; an executable that is not built."""
    workspace.install('arm_canopen', 'master', line='waiting for panda_joint3', ready=False)
    code, output = workspace.run('panda', '--simulate', '--can', 'auto', '--timeout', '1')
    assert code == 1
    assert 'master did not get ready' in output
    assert 'waiting for panda_joint3' in output.split('error: ')[-1]
    (workspace.folder / 'prefix/lib/canopen_sim/fake_slaves').unlink()
    code, output = workspace.run('panda', '--simulate', '--can', 'auto')
    assert code == 2
    assert 'make build' in output


@pytest.mark.slow
@pytest.mark.parametrize(
    ('arguments', 'code', 'words'),
    [
        (['pandora'], 2, "no robot 'pandora'; robots: gp110, panda"),
        (['./nowhere'], 2, 'does not exist'),
        (['panda', '--timeout', 'soon'], 2, 'soon'),
        (['panda', '--timeout', 'nan'], 2, 'no number of seconds above 0'),
        ([], 2, 'robot'),
        (['--help'], 0, 'robots: gp110, panda'),
    ],
)
def test_what_cannot_be_started_says_so_at_once(
    workspace: SmallWorkspace, arguments: list[str], code: int, words: str
) -> None:
    """With exit code 2, and no traceback; the help has the robots, too."""
    found, output = workspace.run(*arguments)
    assert found == code
    assert words in output
    assert 'Traceback' not in output


@pytest.mark.slow
def test_a_robot_without_its_eds_says_which_file_and_line(workspace: SmallWorkspace) -> None:
    """Before anything is started."""
    folder = workspace.folder / 'my_arm'
    folder.mkdir()
    shutil.copy(PANDA / 'bus.yml', folder)
    shutil.copy(PANDA / 'panda.urdf.xacro', folder / 'my_arm.urdf.xacro')
    code, output = workspace.run(f'{folder}/', '--simulate')
    assert code == 2
    assert 'my_arm/bus.yml' in output
    assert 'cia402_slave.eds' in output
    assert 'ready' not in output


@pytest.mark.slow
@pytest.mark.parametrize('what', ['bus', 'namespace'])
def test_a_second_bring_up_on_the_same_is_refused(
    workspace: SmallWorkspace, isolation: Isolation, what: str
) -> None:
    """The first goes on; the message says which process it is and what to do."""
    first_place = ['--can', isolation.bus, '--namespace', 'left']
    second_place = {
        'bus': ['--can', isolation.bus, '--namespace', 'right'],
        'namespace': ['--can', isolation.second_bus, '--ros-args', '-r', '__ns:=/left'],
    }
    with workspace.bringup('panda', '--simulate', *first_place) as first:
        read_until(first, 'all is ready')
        code, output = workspace.run('panda', '--simulate', *second_place[what])
        assert code == 2
        assert f'process {first.pid}' in output
        assert isolation.bus in output if what == 'bus' else '--namespace' in output
        assert 'bye' in ended(first)


@pytest.mark.slow
def test_the_namespace_of_bus_yml_is_that_of_all_nodes(
    workspace: SmallWorkspace, tmp_path: Path
) -> None:
    """Also of those that have no bus.yml, and a bring-up beside it is in another one."""
    folder = tmp_path / 'my_arm'
    shutil.copytree(PANDA, folder)
    for file in ('urdf.xacro', 'srdf'):
        (folder / f'panda.{file}').rename(folder / f'my_arm.{file}')
    text = (folder / 'bus.yml').read_text()
    text = re.sub('(?m)^(master|defaults):\n', r'\g<0>  namespace: cell\n', text)
    (folder / 'bus.yml').write_text(text)
    for (package, name), line in LINES.items():
        workspace.install(package, name, line=f'{line} in {{__ns}}')
    with workspace.bringup(f'{folder}/', '--simulate') as process:
        seen = read_until(process, 'all is ready')
        ended(process)
    assert 'in namespace /cell' in seen
    assert len(re.findall(' in /cell$', seen, re.MULTILINE)) == len(LINES)


@pytest.mark.slow
@pytest.mark.parametrize(
    'words', [['--simulat'], ['--simulate', '--enabl'], ['--can', 'x', '--e']]
)
def test_an_option_that_is_cut_short_moves_nothing(words: list[str]) -> None:
    """It is not taken for the one that it begins."""
    with pytest.raises(SystemExit) as end:
        bringup.parse(['panda', *words])
    assert end.value.code == 2
    with pytest.raises(SystemExit):
        demo(['panda', '--dur', '5'])
