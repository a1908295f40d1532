# SPDX-FileCopyrightText: 2026 The arm and quad developers
# SPDX-License-Identifier: Apache-2.0
"""Namespace and ROS arguments of a bring-up."""

from __future__ import annotations

import argparse
from collections.abc import Sequence
from pathlib import Path

import pytest
import yaml

from process_supervisor import (
    add_namespace,
    Executable,
    namespaced_parameters,
    node_argv,
    parse_with_ros,
    RosOptions,
)


def options(*argv: str) -> RosOptions:
    """Parse a command line with a robot's name."""
    parser = argparse.ArgumentParser()
    parser.add_argument('robot')
    add_namespace(parser)
    arguments, ros = parse_with_ros(parser, ['panda', *argv])
    assert arguments.robot == 'panda'
    return ros


@pytest.mark.parametrize(
    ('argv', 'expected'),
    [
        ([], RosOptions()),
        (['--namespace', '/cell/left'], RosOptions('cell/left')),
        (['--ros-args', '-r', '__ns:=/left'], RosOptions('left')),
        (['--ros-args', '--remap', '__ns:=/left', '--'], RosOptions('left')),
        (
            ['--namespace', 'left', '--ros-args', '-r', '__ns:=/left', '-p', 'a:=1'],
            RosOptions('left', ('-p', 'a:=1')),
        ),
        (
            ['--ros-args', '--disable-rosout-logs', '--log-level', 'debug', '-r', 'a:=b'],
            RosOptions('', ('--disable-rosout-logs', '--log-level', 'debug', '-r', 'a:=b')),
        ),
    ],
)
def test_namespace_and_ros_arguments(argv: Sequence[str], expected: RosOptions) -> None:
    """Both ways to name a namespace are one; all else is passed on as it is."""
    assert options(*argv) == expected


@pytest.mark.parametrize(
    'argv',
    [
        ['--namespace', 'left hand'],
        ['--namespace', ''],
        ['--namespace', '7'],
        ['--namespace', 'left', '--ros-args', '-r', '__ns:=/right'],
        ['--ros-args', '-r', '__node:=arm'],
        ['--ros-args', '-r', 'master:__name:=arm'],
    ],
)
def test_what_cannot_be_is_refused(argv: Sequence[str]) -> None:
    """No namespace, two of them, and one name for all nodes."""
    with pytest.raises(SystemExit) as end:
        options(*argv)
    assert end.value.code == 2


def test_every_node_gets_them(tmp_path: Path) -> None:
    """Behind the parameters of the bring-up, so that a person's count more."""
    node = Executable('package', 'node')
    (tmp_path / 'node').touch(mode=0o755)
    ros = RosOptions('left', ('-p', 'rate:=2'))
    argv = node_argv(node, lambda package, name: tmp_path / name, {'rate': '1'}, ros=ros)
    assert argv[1:] == ('--ros-args', '-p', 'rate:=1', '-r', '__ns:=/left', '-p', 'rate:=2')
    assert ros.resolve('servo_node/status') == '/left/servo_node/status'
    assert ros.frame_prefix == 'left/'
    assert RosOptions().resolve('joint_states') == '/joint_states'
    assert RosOptions().frame_prefix == ''


def test_a_namespace_of_a_file_counts_less() -> None:
    """What a person says goes before what bus.yml says."""
    assert RosOptions('left').within('/right').namespace == 'left'
    assert RosOptions().within('/right/').namespace == 'right'


def test_parameter_files_follow_their_nodes(tmp_path: Path) -> None:
    """Names of nodes get the namespace, patterns stay; without one it is the file itself."""
    file = tmp_path / 'controllers.yaml'
    values = {'ros__parameters': {'rate': 2.0}}
    file.write_text(yaml.safe_dump({'servo_node': values, '/arm': values, '/**': values}))
    moved = namespaced_parameters(file, RosOptions('left'), tmp_path)
    assert yaml.safe_load(moved.read_text()) == {
        '/left/servo_node': values,
        '/left/arm': values,
        '/**': values,
    }
    assert namespaced_parameters(file, RosOptions(), tmp_path) == file
