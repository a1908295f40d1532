# SPDX-FileCopyrightText: 2026 The arm and quad developers
# SPDX-License-Identifier: Apache-2.0
"""docs/reference/nodes.md has what the nodes declare; WRITE_PAGES=1 writes it anew."""

from __future__ import annotations

from contextlib import AbstractContextManager, ExitStack
from dataclasses import dataclass
import os
from pathlib import Path
import time

from held_key import held_key
from isolation import Isolation
from manual_page import CHECKOUT
from node_tables import page_of, read_page, rows_of
from processes import executable, RunningProcess
import pytest

pytestmark = pytest.mark.scenario

PAGE = CHECKOUT / 'docs' / 'reference' / 'nodes.md'
RECORDER = Path(__file__).with_name('node_recorder')
TIMEOUT = 90.0  # [s] until all is declared, on a busy machine
QUIET = 10.0  # [s] after which nothing more is declared
WRITE = bool(os.environ.get('WRITE_PAGES'))


@dataclass(frozen=True, slots=True)
class Run:
    """Programs that run together.

    Attributes:
        commands: Each as package, program and arguments; BUS stands for the CAN bus.
        programs: Whose nodes are compared, as "package program".
        terminal: Whether they read keys.
    """

    commands: tuple[str, ...]
    programs: tuple[str, ...]
    terminal: bool = False


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
