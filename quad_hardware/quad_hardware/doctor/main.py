# SPDX-FileCopyrightText: 2026 The arm and quad developers
# SPDX-License-Identifier: Apache-2.0
"""Diagnoses serial port, robot, machine and ROS setup of the quadruped."""

from __future__ import annotations

import argparse
from collections.abc import Iterator, Mapping, Sequence
import importlib.util
from importlib.util import find_spec
import os
from pathlib import Path
import re
import stat

from serial.tools import list_ports

from dds_network import NETWORK_VARIABLE, NetworkChoiceError, selected_reach
from quad_description import LOW_BATTERY, run_command

from ..exceptions import LinkError, NoAnswerError
from ..link import BATTERY, connect, DEFAULT_PORT, latency_problem, latency_timer, read_value
from ..link.open import PSEUDO_TERMINALS
from ..link.vendor import is_installed
from ..protocol import model_of_firmware, V1
from . import error, Finding, good, note, Severity, warning

MIN_MEMORY = 300e6  # [B] below that, processes are soon ended


def check_environment(environment: Mapping[str, str]) -> Iterator[Finding]:
    """Check the environment variables that ROS reads."""
    if 'AMENT_PREFIX_PATH' not in environment:
        remedy = (
            'source the workspace first: `source env.sh`, or `source /opt/ros/<distro>/setup.bash`'
            ' and install/setup.bash (scripts, cron and systemd do not do it for you)'
        )
        yield error('environment', 'no ROS workspace is sourced', remedy)
    else:
        yield good(
            'environment', f'ROS {environment.get("ROS_DISTRO", "of unknown distribution")}'
        )
    domain = environment.get('ROS_DOMAIN_ID', '0')
    if not domain.isdigit() or not 0 <= int(domain) <= 232:
        yield error('domain', f'ROS_DOMAIN_ID is {domain!r}', 'export ROS_DOMAIN_ID=0')
    else:
        yield _reach(domain, environment)


def _reach(domain: str, environment: Mapping[str, str]) -> Finding:
    try:
        reach = selected_reach(environment)
    except NetworkChoiceError as problem:
        remedy = f'export {NETWORK_VARIABLE} with an interface or a peer that exists'
        return error('domain', f'{NETWORK_VARIABLE}: {problem}', remedy)
    if reach.is_this_host:
        return note(
            'domain',
            f'{domain}; {reach.describe()}',
            f'to reach other machines: export {NETWORK_VARIABLE}=INTERFACE, and the same '
            'ROS_DOMAIN_ID on each',
        )
    return good('domain', f'{domain}, the same everywhere; {reach.describe()}')


def check_memory(meminfo: str) -> Iterator[Finding]:
    """Check the memory figures in the text of /proc/meminfo."""
    rows = dict(line.split(':', 1) for line in meminfo.splitlines() if ':' in line)
    available = float(rows.get('MemAvailable', '0 kB').split()[0]) * 1024
    if available < MIN_MEMORY:
        remedy = 'end other programs (free -h), build with --parallel-workers 1'
        yield warning('memory', f'{available / 1e6:.0f} MB available', remedy)
    else:
        yield good('memory', f'{available / 1e6:.0f} MB available')


def check_library() -> Finding:
    """Report which xgo_lib2 Python imports: ours or the vendor's."""
    spec = importlib.util.find_spec('xgo_lib2')
    if spec is None:
        return warning('xgo_lib2', 'not found', 'build the workspace: it brings one of its own')
    import xgo_lib2

    vendors = is_installed()
    whose = f'the vendor’s, {xgo_lib2.__file__}' if vendors else 'the stand-in of this workspace'
    return good('xgo_lib2', whose)


GROUP = 'dialout'
_TERMINAL = re.compile(r'^tty-index:\s*(\d+)$', re.MULTILINE)


def check_port(path: str) -> Iterator[Finding]:
    """Check a port, and query the robot if no other program uses the port."""
    if not Path(path).exists():
        ports = [port.device for port in list_ports.comports()]
        there = f'there are {", ".join(ports)}; ' if ports else 'no serial port was found; '
        remedy = f'{there}choose with --port, or see that the robot is plugged in and switched on'
        yield error('port', f'{path} does not exist', remedy)
        return
    if not stat.S_ISCHR(Path(path).stat().st_mode):
        yield error('port', f'{path} is not a device', 'choose the serial port with --port')
        return
    real = os.path.realpath(path)
    yield good('port', path if real == path else f'{path} -> {real}')
    if not os.access(path, os.R_OK | os.W_OK):
        remedy = f'sudo usermod -aG {GROUP} $USER, then log in again'
        yield error('permission', f'{path} may not be read and written by this user', remedy)
        return
    yield good('permission', 'may be read and written')
    users = list(port_users(real))
    if users:
        yield note('port user', f'in use by {", ".join(users)}; the robot was not contacted')
        return
    yield from _contact(path)
    yield from check_latency(path, latency_timer(path))  # opening the port may have changed it


def check_latency(path: str, latency: float | None) -> Iterator[Finding]:
    """Check the latency timer of a USB adapter [s], if the port has one."""
    if latency is None:
        return
    what, _, remedy = latency_problem(path, latency).partition(': ')
    if what:
        yield warning('adapter', what, remedy)
    else:
        yield good('adapter', f'latency timer of {latency * 1e3:.0f} ms')


def port_users(device: str) -> Iterator[str]:
    """Yield the programs that have a device open, as far as permissions show.

    A simulated robot that keeps its own port open does not count as a user.
    """
    for process in Path('/proc').glob('[0-9]*'):
        if int(process.name) == os.getpid():
            continue
        try:
            files = {os.path.realpath(entry) for entry in (process / 'fd').iterdir()}
            words = (process / 'cmdline').read_bytes().split(b'\0')
        except OSError:  # it ended, or is another user's
            continue
        if device in files and not _makes(process, device):
            yield f'{_program(words)} (process {process.name})'


def _makes(process: Path, device: str) -> bool:
    """Return whether a process is the simulated robot behind a pseudo-terminal."""
    number = Path(device).name
    for entry in (process / 'fdinfo').iterdir():
        try:
            # proc(5): the number of the terminal that a multiplexer's descriptor leads to
            found = _TERMINAL.search(entry.read_text(encoding='ascii'))
        except OSError:  # it was closed meanwhile
            continue
        if found and Path(device).parent == PSEUDO_TERMINALS and found[1] == number:
            return True
    return False


def _program(words: list[bytes]) -> str:
    """Return the name of a program; for a script, its own name."""
    names = [Path(word.decode(errors='replace')).name for word in words if word]
    scripts = [name for name in names[:2] if not name.startswith('python')]
    return (scripts or names or ['?'])[0]


def _contact(path: str) -> Iterator[Finding]:
    try:
        connection = connect(path)
        with connection.port as port:
            charge = read_value(port, connection.protocol, BATTERY)
    except NoAnswerError as problem:
        yield error(
            'robot',
            str(problem),
            'switch the robot on; on a Raspberry Pi, free the port from the serial console '
            '(raspi-config, Interface Options, Serial Port)',
        )
        return
    except LinkError as problem:
        yield error('robot', str(problem), 'see the message')
        return
    protocol = connection.protocol
    yield good('robot', f'{connection.firmware}, protocol {protocol.name} at {port.baud} baud')
    model = model_of_firmware(connection.firmware)
    if model is None and protocol is V1:
        remedy = 'set the parameter model of hardware_node to mini, lite or wheeled'
        yield warning('firmware', 'its first letter names no quadruped', remedy)
    yield _judge_battery(None if charge is None else charge[0])


def _judge_battery(charge: int | None) -> Finding:
    if charge is None:
        return warning('battery', 'the robot does not report its charge', 'try once more')
    if charge < 100.0 * LOW_BATTERY:
        return warning('battery', f'at {charge} %', 'charge it: a weak robot falls')
    return good('battery', f'at {charge} %')


def run_doctor(argv: Sequence[str]) -> int:
    """Print all findings; return 1 if any is an error, else 0."""
    options = _parser().parse_args(argv)
    worst = Severity.GOOD
    order = list(Severity)
    for finding in _findings(options.port, options.duration):
        print(finding, flush=True)  # noqa: T201  # what the program is for
        worst = max(worst, finding.severity, key=order.index)
    return 1 if worst is Severity.ERROR else 0


def main() -> None:
    """Entry point."""
    run_command(run_doctor)


def _parser() -> argparse.ArgumentParser:
    parser = argparse.ArgumentParser(description=__doc__, allow_abbrev=False)
    parser.add_argument('--port', default=DEFAULT_PORT, help='of the robot (%(default)s)')
    parser.add_argument(
        '--duration', type=float, default=3.0, help='of listening to topics [s] (%(default)s)'
    )
    return parser


def _findings(port: str, duration: float) -> Iterator[Finding]:
    has_ros = find_spec('rclpy') is not None
    if has_ros:
        yield from check_environment(os.environ)
    else:
        remedy = 'source env.sh first, if nodes are to be checked, too'
        yield note('ROS', 'not there for this Python: robot and machine are checked alone', remedy)
    meminfo = Path('/proc/meminfo')
    if meminfo.exists():
        yield from check_memory(meminfo.read_text(encoding='ascii'))
    yield check_library()
    yield from check_port(port)
    if not has_ros:
        return
    try:
        from .graph import check_graph, observe
    except ImportError as problem:
        yield error('ROS', str(problem), 'source the workspace first: source env.sh')
        return
    yield from check_graph(observe(duration), port)


if __name__ == '__main__':
    main()
