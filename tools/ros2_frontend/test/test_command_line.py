# SPDX-FileCopyrightText: 2026 The arm and quad developers
# SPDX-License-Identifier: Apache-2.0
"""The tree of commands: help, wrong arguments, exit codes, Ctrl-C and closed pipes."""

from __future__ import annotations

from collections.abc import Mapping
import os
from pathlib import Path
import signal
import subprocess
import sys

from frontend_cli import PROGRAM, Ros2, with_frontend
from processes import RunningProcess
import pytest

from ros2_frontend.cli.commands import COMMANDS

pytestmark = pytest.mark.slow


@pytest.mark.parametrize(
    ('group', 'lines'),
    [
        (
            [],
            [
                'ros2 is an extensible command-line tool for ROS 2.',
                '  topic      Various topic related sub-commands\n',
                '  Call `ros2 <command> -h` for more detailed usage.\n',
            ],
        ),
        (['topic'], ['  hz     Print the average receiving rate to screen\n']),
    ],
)
def test_help_lists_every_command(ros2: Ros2, group: list[str], lines: list[str]) -> None:
    """With the words of ros2cli; without a command or a verb, too, with exit code 0."""
    outcome = ros2(*group, '--help')
    assert outcome.code == 0
    assert all(line in outcome.out for line in lines)
    assert ros2(*group) == outcome


def test_every_command_has_help(ros2: Ros2) -> None:
    """Its module can be imported, its arguments can be added, its summary is shown."""
    for words, (summary, target) in COMMANDS.items():
        if not target:
            continue
        outcome = ros2(*words.split(), '--help')
        assert outcome.code == 0
        assert outcome.out.startswith(f'usage: ros2 {words} ')
        assert ' '.join(summary.split()) in ' '.join(outcome.out.split())


@pytest.mark.parametrize(
    ('words', 'problem'),
    [
        (('nothing',), "invalid choice: 'nothing'"),
        (('topic', 'nothing'), "invalid choice: 'nothing'"),
        (('topic', 'info'), 'the following arguments are required: topic_name'),
        (('param', 'load', 'n'), 'the following arguments are required: parameter_file'),
        (('topic', 'echo', '/a', '-l', '-1'), 'value must be non-negative integer'),
        (('topic', 'hz', '/a', '-w', '0'), 'value must be a positive integer'),
        (('topic', 'pub', '/a', 'b', '-1', '-t', '2'), 'not allowed with argument'),
        (('topic', 'hz', '/a', '-w', 'x'), 'value must be a positive integer'),
        (('topic', 'pub', '/a', 'b', '-r', '0'), 'value must be a positive float'),
        (('topic', 'pub', '/a', 'b', '-r', 'inf'), 'value must be a positive float'),
        (('topic', 'pub', '/a', 'b', '-r', 'x'), 'value must be a positive float'),
        (('bag', 'play', '/a', '-d', '-1'), 'value must be a non-negative float'),
        (('interface', 'show', 'a', '--no-comments', '--all-comments'), 'not allowed with'),
    ],
)
def test_wrong_arguments(ros2: Ros2, words: tuple[str, ...], problem: str) -> None:
    """Exit code 2, usage and reason on stderr."""
    outcome = ros2(*words)
    assert (outcome.code, outcome.out) == (2, '')
    assert outcome.err.startswith('usage: ros2')
    assert problem in outcome.err


@pytest.mark.parametrize(
    ('words', 'needless'),
    [
        ([], {'rclpy', 'numpy.linalg', 'yaml.loader'}),
        (['topic', '-h'], {'rclpy', 'numpy.linalg', 'yaml.loader'}),
        (['pkg', 'list'], {'rclpy', 'numpy.linalg', 'yaml.loader'}),
        # a class of a service, and values that it refuses
        (['service', 'call', '/a', 'std_srvs/srv/Trigger', '{b: 1}'], {'numpy.linalg'}),
    ],
)
def test_commands_import_only_what_they_need(words: list[str], needless: set[str]) -> None:
    """Help and package commands start without rclpy and YAML, others without numpy."""
    code = (
        'import sys; from ros2_frontend.main import main\n'
        f'try: main({words})\nexcept SystemExit: pass\n'
        f'sys.exit(bool({needless} & set(sys.modules)))'
    )
    done = subprocess.run(
        [sys.executable, '-c', code],
        env=with_frontend(os.environ),
        capture_output=True,
        check=False,
    )
    assert done.returncode == 0


@pytest.mark.scenario
def test_a_command_is_in_the_graph_before_rclpy_and_leaves_if_it_is_refused(
    zoo_env: Mapping[str, str], ros2: Ros2, monkeypatch: pytest.MonkeyPatch
) -> None:
    """Discovery goes on during the imports; a wrong argument leaves no node behind."""
    code = (
        'import sys; from ros2_frontend import main\n'
        'def refuse(words):\n'
        '    assert "rclpy" not in sys.modules\n'
        '    print("joined", flush=True); sys.stdin.readline(); sys.exit(2)\n'
        'main._run = refuse\n'
        'main.main(["topic", "list"])'
    )
    monkeypatch.setenv('ROS_DOMAIN_ID', zoo_env['ROS_DOMAIN_ID'])
    with subprocess.Popen(
        [sys.executable, '-c', code],
        env=zoo_env,
        stdin=subprocess.PIPE,
        stdout=subprocess.PIPE,
        text=True,
    ) as process:
        assert process.stdout is not None
        assert process.stdout.readline() == 'joined\n'
        name = f'/_ros2cli_{process.pid}_joining'
        assert name in ros2('node', 'list', '--all').lines
        process.communicate('\n')
        assert process.returncode == 2
    assert name not in ros2('node', 'list', '--all').lines


@pytest.mark.scenario
@pytest.mark.parametrize('number', [signal.SIGINT, signal.SIGTERM])
def test_interrupts_are_quiet(zoo_env: Mapping[str, str], number: signal.Signals) -> None:
    """Ctrl-C, and SIGTERM, end a command at once with ros2cli's exit code and no traceback.

    So they do in the background of a script, where shells start it with SIGINT ignored.
    """
    ignoring = ['sh', '-c', 'trap "" INT; exec "$@"', 'sh']
    with RunningProcess([*ignoring, *PROGRAM, 'topic', 'echo', '/chatter'], zoo_env) as process:
        process.wait_for('^data: ')
        process.signal(number)
        assert process.wait() == 2
        assert 'Traceback' not in process.output


@pytest.mark.scenario
def test_an_interrupt_while_a_module_is_imported_is_quiet(
    zoo_env: Mapping[str, str], tmp_path: Path
) -> None:
    """Python makes a namedtuple by `eval()`; with `-m` an interrupt of that ended by SIGINT."""
    interrupt = "__import__('os').kill(__import__('os').getpid(), 2)"
    (tmp_path / 'difflib.py').write_text(f'eval({interrupt!r})\n')
    env = {**zoo_env, 'PYTHONPATH': f'{tmp_path}{os.pathsep}{zoo_env["PYTHONPATH"]}'}
    with RunningProcess([*PROGRAM, 'topic', 'hz', '/never'], env) as process:
        assert process.wait() == 2
        assert 'Traceback' not in process.output


def test_what_rcl_refuses_is_no_traceback(ros2: Ros2, monkeypatch: pytest.MonkeyPatch) -> None:
    """The message of rcl names the variable; exit code 1."""
    monkeypatch.setenv('ROS_DOMAIN_ID', 'x')
    outcome = ros2('node', 'list')
    assert (outcome.code, outcome.out) == (1, '')
    assert 'ROS_DOMAIN_ID is not an integral number' in outcome.err


@pytest.mark.scenario
def test_a_closed_pipe_is_quiet(zoo_env: Mapping[str, str]) -> None:
    """`| head -1` gets its line, and the command leaves like any Unix tool."""
    words = [*PROGRAM, 'topic', 'echo', '/chatter']
    with subprocess.Popen(
        words, env=zoo_env, stdout=subprocess.PIPE, stderr=subprocess.PIPE, text=True
    ) as process:
        assert process.stdout is not None
        assert process.stdout.readline().startswith('data: ')
        process.stdout.close()
        assert process.wait(timeout=20) == 128 + signal.SIGPIPE
        assert process.stderr is not None
        assert process.stderr.read() == ''
