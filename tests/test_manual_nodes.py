# SPDX-FileCopyrightText: 2026 The arm and quad developers
# SPDX-License-Identifier: Apache-2.0
"""docs/reference/nodes.md has what the nodes declare; WRITE_PAGES=1 writes it anew."""

from __future__ import annotations

from collections import defaultdict
from collections.abc import Iterable, Sequence
from contextlib import AbstractContextManager, ExitStack
from dataclasses import dataclass
import json
import os
from pathlib import Path
import re
import time

from isolation import Isolation
from manual_page import CHECKOUT
from processes import executable, RunningProcess
import pytest
from terminals import held_key

HEAD = """# Nodes

What the nodes of each program offer: parameters with their defaults, topics with their quality of
service, services and actions. The tables are made of what the programs declare while they run in a
simulation, and a test compares them. `<joint>` is a drive or joint, `<group>` a group of the SRDF.
*Fixed* parameters are set when a program starts, the others while it runs, too. A `master` without
motion core has the node `/master` and those of its drives, as `motion_node` has. Left out is what
every node has: `use_sim_time`, `qos_overrides`, `/rosout`, `/parameter_events`, services of types
and parameters.
"""
ONE_OF_MANY = re.compile(r'/panda_joint[2-9]$')  # drives are alike
NAMES = (
    (r'panda_joint\d', '<joint>'),
    (r'panda_arm', '<group>'),
    (r'panda_hand', '<end effector>'),
)
SAME = {'use_sim_time', 'start_type_description_service'}
OF_EVERY_NODE = re.compile(
    r'/(rosout|parameter_events)$|/(describe|get|list|set)_parameters(_atomically)?$'
    r'|/get_parameter_types$|/get_type_description$|/get_logger_levels$|/set_logger_levels$|/_action/'
)
ENDPOINTS = '| | name | type | quality of service |'
PARAMETERS = '| parameter | type | default | values | meaning |'
LONGEST = 60  # characters of a default
KINDS = {
    'publisher': 'publishes',
    'subscription': 'subscribes',
    'service': 'service',
    'action': 'action',
}


def rows_of(lines: Iterable[str], programs: Sequence[str]) -> dict[str, set[str]]:
    """Return the rows of the tables of each node, from what was recorded.

    Args:
        lines: Lines of the recorder.
        programs: Whose nodes count.
    """
    found: dict[str, set[str]] = defaultdict(set)
    for line in lines:
        entry = json.loads(line)
        if entry['program'] not in programs or ONE_OF_MANY.search(entry['node']):
            continue
        if entry['name'] in SAME or entry['name'].startswith('qos_overrides'):
            continue
        if OF_EVERY_NODE.search(entry['name']) and entry['kind'] != 'parameter':
            continue
        found[f'{entry["program"]}: {_general(entry["node"])}'].add(_row(entry))
    return dict(found)


def page_of(nodes: dict[str, set[str]]) -> str:
    """Return the page."""
    parts = [HEAD]
    program = ''
    for title, rows in sorted(nodes.items()):
        owner, _, node = title.partition(': ')
        if owner != program:
            program = owner
            parts.append(f'## {program}\n')
        parts.append(f'### `{node}`\n')
        parameters = {row for row in rows if row.startswith('| `')}
        for head, these in ((ENDPOINTS, rows - parameters), (PARAMETERS, parameters)):
            if these:
                columns = '|---' * (head.count('|') - 1) + '|'
                parts.append('\n'.join([head, columns, *sorted(these)]) + '\n')
    return '\n'.join(parts)


def read_page(text: str) -> dict[str, set[str]]:
    """Return the rows of each node of a page."""
    found: dict[str, set[str]] = {}
    program = title = ''
    for line in text.splitlines():
        if line.startswith('## '):
            program = line[3:]
        elif line.startswith('### '):
            title = f'{program}: {line[5:-1]}'
            found[title] = set()
        elif title and line.startswith('| ') and line not in {ENDPOINTS, PARAMETERS}:
            found[title].add(line)
    return found


def _row(entry: dict[str, object]) -> str:
    name = _general(str(entry['name']))
    if entry['kind'] != 'parameter':
        kind, quality = KINDS[str(entry['kind'])], entry.get('qos', '')
        return f'| {kind} | `{name}` | `{entry["type"]}` | {quality} |'
    fixed = 'fixed' if entry['fixed'] else ''
    values = ', '.join(part for part in (str(entry['range']), fixed) if part)
    about = _general(str(entry['about']))
    return (
        ' | '.join(
            [
                f'| `{name}`',
                str(entry['type']),
                _default(entry['default']),
                _cell(values),
                _cell(about),
            ]
        )
        + ' |'
    )


def _default(value: object) -> str:
    if value is None or value in ([], ''):
        return ''
    text = _general(json.dumps(value))
    return f'`{text}`' if len(text) <= LONGEST else f'`{text[:LONGEST]}` ...'


def _cell(text: str) -> str:
    return ' '.join(text.split()).replace('|', '\\|')


def _general(text: str) -> str:
    for pattern, name in NAMES:
        text = re.sub(pattern, name, text)
    return text


pytestmark = pytest.mark.scenario

PAGE = CHECKOUT / 'docs' / 'reference' / 'nodes.md'
RECORDER = Path(__file__).with_name('node_recorder')
TIMEOUT = 90.0  # [s] until all is declared, on a busy machine
QUIET = 10.0  # [s] after which nothing more is declared
WRITE = bool(os.environ.get('WRITE_PAGES'))


@dataclass(frozen=True, slots=True)
class Run:
    """Programs that run together."""

    commands: tuple[str, ...]  # each as package, program and arguments; BUS stands for the CAN bus
    programs: tuple[str, ...]  # whose nodes are compared, as "package program"
    terminal: bool = False  # whether they read keys


RUNS = {
    'arm': Run(
        ('arm_bringup bringup panda --simulate --plan --can BUS',),
        (
            'arm_planning move_group',
            'arm_servo motion_node',
            'canopen_sim fake_slaves',
            'robot_viewer robot_state_publisher',
        ),
    ),
    'quad': Run(
        ('quad_bringup bringup --simulate',),
        ('quad_controller controller_node', 'quad_hardware hardware_node', 'quad_sim fake_xgo'),
    ),
    'teleop': Run(
        ('arm_servo servo_keyboard_input', 'quad_teleop teleop_keyboard'),
        ('arm_servo servo_keyboard_input', 'quad_teleop teleop_keyboard'),
        terminal=True,
    ),
    'alone': Run(
        (
            'quad_teleop twist_mux',
            'quad_teleop teleop_gamepad',
            'arm_servo servo_gamepad',
            'robot_viewer web_viewer',
        ),
        (
            'quad_teleop twist_mux',
            'quad_teleop teleop_gamepad',
            'arm_servo servo_gamepad',
            'robot_viewer web_viewer',
        ),
    ),
}


@pytest.mark.parametrize('name', RUNS)
def test_the_page_has_what_nodes_declare(isolation: Isolation, tmp_path: Path, name: str) -> None:
    """Neither more nor less: nodes, parameters, topics, services, actions."""
    run = RUNS[name]
    path = os.pathsep.join([str(RECORDER), isolation.env.get('PYTHONPATH', '')])
    env = isolation.env | {'RECORD_NODES': str(tmp_path), 'PYTHONPATH': path}
    with ExitStack() as stack:
        for command in run.commands:
            stack.enter_context(started(run, command.replace('BUS', isolation.bus), env))
        if WRITE:
            found = wait_until_quiet(tmp_path, run)
            text = PAGE.read_text('utf-8') if PAGE.exists() else ''
            others = {
                title: rows
                for title, rows in read_page(text).items()
                if title.partition(': ')[0] not in run.programs
            }
            PAGE.write_text(page_of(others | found), encoding='utf-8')
        shown = {
            title: rows
            for title, rows in read_page(PAGE.read_text('utf-8')).items()
            if title.partition(': ')[0] in run.programs
        }
        assert shown
        deadline = time.monotonic() + TIMEOUT
        while (found := recorded(tmp_path, run)) != shown and time.monotonic() < deadline:
            time.sleep(0.2)
    assert found == shown, f'{PAGE.name} is stale: WRITE_PAGES=1 pytest {Path(__file__).name}'


def started(run: Run, command: str, env: dict[str, str]) -> AbstractContextManager[object]:
    """Start a program, in a terminal if it wants one."""
    package, program, *arguments = command.split()
    words = [executable(package, program), *arguments]
    return held_key('', words, env) if run.terminal else RunningProcess(words, env)


def recorded(folder: Path, run: Run) -> dict[str, set[str]]:
    """Return what was declared so far; a line that is not yet whole counts next time."""
    texts = [path.read_text('utf-8') for path in folder.glob('*.jsonl')]
    lines = [line for text in texts for line in text.rpartition('\n')[0].splitlines()]
    return rows_of(lines, run.programs)


def wait_until_quiet(folder: Path, run: Run) -> dict[str, set[str]]:
    """Return what is declared when nothing more comes."""
    found, since = recorded(folder, run), time.monotonic()
    while not found or time.monotonic() - since < QUIET:
        time.sleep(0.5)
        if (now := recorded(folder, run)) != found:
            found, since = now, time.monotonic()
    return found
