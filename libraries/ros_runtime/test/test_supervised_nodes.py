# SPDX-FileCopyrightText: 2026 The arm and quad developers
# SPDX-License-Identifier: Apache-2.0
"""ROS nodes as processes, the page of a bring-up, and arguments that bring-ups and demos share."""

from __future__ import annotations

import argparse
import math
from pathlib import Path

import pytest
import yaml

from process_supervisor import (
    add_view,
    EVERY_NODE,
    Executable,
    node_argv,
    ros_domain,
    RosOptions,
    StartError,
    view_process,
    write_parameters,
)
from process_supervisor.ros_options import seconds_from
from process_supervisor.spec import no_answer

NODE = Executable('some_package', 'some_node')


def test_a_workspace_that_is_not_built_is_reported(tmp_path: Path) -> None:
    """A missing package and a missing executable are distinguished."""
    with pytest.raises(StartError, match=r'some_package is not in .*; source env.sh.*make build'):
        node_argv(NODE, lambda package, name: None)
    with pytest.raises(StartError, match=r'some_node does not exist.*make build'):
        node_argv(NODE, lambda package, name: tmp_path / name)


@pytest.mark.parametrize('urdf', ['<a b="c: d"/>', '# no comment\n\t<x/>', "it's ü \\ \u2028"])
def test_a_description_survives_the_parameter_file(tmp_path: Path, urdf: str) -> None:
    """Whatever characters are in it."""
    file = tmp_path / 'parameters.yaml'
    write_parameters(file, urdf)
    assert yaml.safe_load(file.read_text()) == {
        EVERY_NODE: {'ros__parameters': {'robot_description': urdf}}
    }


@pytest.mark.parametrize(('given', 'domain'), [(None, '0'), ('', '0'), ('7', '7'), ('232', '232')])
def test_the_ros_domain_is_that_of_the_environment(given: str | None, domain: str) -> None:
    """Zero when there is none."""
    environment = {} if given is None else {'ROS_DOMAIN_ID': given}
    assert ros_domain(environment) == domain


@pytest.mark.parametrize('given', ['abc', '-1', '233', '1.5'])
def test_what_is_no_ros_domain_is_refused_before_anything_starts(given: str) -> None:
    """With one sentence instead of a traceback of each process."""
    with pytest.raises(StartError, match=f'{given}.*0 to 232'):
        ros_domain({'ROS_DOMAIN_ID': given})


@pytest.mark.parametrize(
    ('variable', 'words', 'view'),
    [
        (None, [], True),
        ('', [], True),
        ('0', [], True),
        ('1', [], False),
        (None, ['--no-view'], False),
        ('0', ['--no-view'], False),
    ],
)
def test_option_or_variable_turn_it_off(
    monkeypatch: pytest.MonkeyPatch, variable: str | None, words: list[str], *, view: bool
) -> None:
    """As make passes the variable on, which is empty without one."""
    monkeypatch.delenv('NO_VIEW', raising=False)
    if variable is not None:
        monkeypatch.setenv('NO_VIEW', variable)
    parser = argparse.ArgumentParser()
    add_view(parser)
    assert parser.parse_args(words).view is view


def test_the_robot_needs_no_page(tmp_path: Path) -> None:
    """Not required, not awaited, ends soon, after what moves the robot; may not be built."""
    assert view_process(lambda *_: None, RosOptions(), ready_timeout=7.0, stop_order=1) is None
    program = tmp_path / 'web_viewer'
    program.touch(mode=0o755)
    ros = RosOptions('left', ('-p', 'port:=9000'))
    spec = view_process(lambda *_: program, ros, ready_timeout=7.0, stop_order=1)
    assert spec is not None
    assert not spec.required
    assert not spec.awaited
    assert spec.ready_timeout == 7.0
    assert sum(step.timeout for step in spec.stop_steps) <= 12.0  # Python ends slowly there
    assert spec.argv[0] == 'nice'
    assert spec.argv[spec.argv.index('-p') + 1] == 'frame_prefix:=left/'
    assert spec.argv[-2:] == ('-p', 'port:=9000')


def test_times_of_the_command_line() -> None:
    """Short, negative, endless and senseless times are refused with what they must be."""
    assert seconds_from(5.0)('5') == 5.0
    assert seconds_from(0.0, finite=False)('inf') == math.inf
    for text, least, words in [('4.9', 5.0, 'at least 5'), ('0', 0.0, 'above 0')]:
        with pytest.raises(argparse.ArgumentTypeError, match=words):
            seconds_from(least)(text)
    for text in ('nan', 'inf', '-1', 'soon'):
        with pytest.raises(argparse.ArgumentTypeError, match=f'{text} is no number of seconds'):
            seconds_from(0.0)(text)


@pytest.mark.parametrize(
    ('waited', 'text'), [(14.9987, '15 s'), (0.25, '0.2 s'), (120.0, '120 s'), (0.0, '0 s')]
)
def test_the_time_is_rounded_and_a_busy_machine_is_thought_of(waited: float, text: str) -> None:
    """The rest of a time-out is no round number, and its digits have no meaning."""
    message = str(no_answer('the answers of joint1/init', waited))
    assert message.startswith(f'waited {text} in vain for the answers of joint1/init; ')
    assert 'is this machine too busy?' in message
