# SPDX-FileCopyrightText: 2026 The arm and quad developers
# SPDX-License-Identifier: Apache-2.0
"""Namespace and ROS arguments of a bring-up."""

from __future__ import annotations

import argparse
from collections.abc import Sequence
import json
from pathlib import Path
from typing import Any

import pytest
import rclpy
from rclpy.context import Context
from rclpy.node import Node
import yaml

from process_supervisor import (
    add_namespace,
    Executable,
    namespaced_parameters,
    node_argv,
    parse_with_ros,
    RosOptions,
    StartError,
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
    files = [Path('p.yaml')]
    argv = node_argv(node, lambda package, name: tmp_path / name, {'rate': '1'}, files, ros)
    own = ('--params-file', 'p.yaml', '-p', 'rate:=1')
    assert argv[1:] == ('--ros-args', *own, '-r', '__ns:=/left', '-p', 'rate:=2')
    assert ros.resolve('servo_node/status') == '/left/servo_node/status'
    assert ros.frame_prefix == 'left/'
    assert RosOptions().resolve('joint_states') == '/joint_states'
    assert RosOptions().frame_prefix == ''


def test_a_namespace_of_a_file_counts_less() -> None:
    """What a person says goes before what bus.yml says."""
    assert RosOptions('left').within('/right').namespace == 'left'
    assert RosOptions().within('/right/').namespace == 'right'


def moved(document: object, ros: RosOptions, folder: Path) -> object:
    """Return what becomes of a parameter file."""
    file = folder / 'controllers.yaml'
    file.write_text(json.dumps(document))
    return yaml.safe_load(namespaced_parameters(file, ros, folder).read_text())


@pytest.mark.parametrize(
    ('name', 'full'),
    [
        ('servo_node', '/left/servo_node'),
        ('/servo_node', '/left/servo_node'),
        ('/left/servo_node', '/left/servo_node'),
        ('left/servo_node', '/left/servo_node'),
        ('gripper/driver', '/left/gripper/driver'),
        ('/left/**', '/left/**'),
        ('/*/servo_node', '/*/servo_node'),
        ('/**/servo_node', '/**/**/servo_node'),
        ('/**', '/**/**'),
    ],
)
def test_parameter_files_follow_their_nodes(tmp_path: Path, name: str, full: str) -> None:
    """Names of nodes get the namespace that they do not have; patterns go on to match."""
    values = {'ros__parameters': {'rate': 2.0}}
    assert moved({name: values}, RosOptions('left'), tmp_path) == {full: values}


def test_all_parameters_of_a_node_are_kept(tmp_path: Path) -> None:
    """In nested namespaces, and by several spellings of one node."""
    document = {
        'left': {'servo_node': {'ros__parameters': {'rate': 2.0}}},
        'servo_node': {'ros__parameters': {'scale': {'linear': 1.0}}},
        '/servo_node': {'ros__parameters': {'scale': {'joint': 3.0}, 'rate': 4.0}},
    }
    expected = {'rate': 4.0, 'scale': {'linear': 1.0, 'joint': 3.0}}
    node = {'/left/servo_node': {'ros__parameters': expected}}
    assert moved(document, RosOptions('left'), tmp_path) == node


VALUES = """
  rate: 1e-3
  time: 1:30
  day: 2026-01-31
  text: "1"
  switch: off
  gains: [1e-3, 2.0]
  lines: |
    one
    two
  nested: {a: 0x10, b: {c: 010}}
"""


def test_rcl_reads_the_values_of_a_file_as_they_stand(tmp_path: Path) -> None:
    """PyYAML takes 1e-3 for text, 1:30 for 90 and a date for a date; rcl does not."""
    file = tmp_path / 'controllers.yaml'
    file.write_text('node:\n ros__parameters:' + VALUES)
    as_it_stands, copied = (
        repr(parameters_of('node', '--params-file', str(read)))
        for read in (file, namespaced_parameters(file, RosOptions(), tmp_path))
    )
    assert "'rate': 0.001" in as_it_stands
    assert copied == as_it_stands


@pytest.mark.parametrize('document', ['text', [1], {'servo_node': 1}, {'a': {'b': 'c'}}])
def test_what_is_no_parameter_file_is_refused(tmp_path: Path, document: object) -> None:
    """By name, before anything starts."""
    with pytest.raises(StartError, match='no ROS parameter file'):
        moved(document, RosOptions('left'), tmp_path)


@pytest.mark.parametrize('word', ['node:rate:=2', '/node:rate:=2', 'rate:=2'])
def test_parameters_for_one_node_reach_it(word: str) -> None:
    """A person names the node by itself or in full; rcl takes no slash."""
    assert rate_of('node', RosOptions('', ('-p', word))) == 2
    assert rate_of('other', RosOptions('', ('-p', word))) == (2 if word == 'rate:=2' else None)


@pytest.mark.parametrize('word', ['node:rate:=2', '/left/node:rate:=2', '/**:rate:=2'])
def test_parameters_for_one_node_in_a_namespace_belong_into_a_file(
    word: str, tmp_path: Path
) -> None:
    """By -p rcl finds nodes of the root namespace only: an error, or no effect."""
    with pytest.raises(StartError, match='--params-file'):
        assert RosOptions('left', ('-p', word)).node_arguments
    file = tmp_path / 'rates.yaml'
    file.write_text('/left/node: {ros__parameters: {rate: 2}}')
    assert rate_of('node', RosOptions('left', ('--params-file', str(file)))) == 2


def test_values_with_colons_and_remaps_are_passed_on() -> None:
    """They are no names of nodes."""
    arguments = ('-p', 'url:=http://x:=y', '-r', 'servo_node:a:=b')
    assert RosOptions('left', arguments).node_arguments[2:] == arguments


def parameters_of(name: str, *arguments: str) -> dict[str, Any]:
    """Return the parameters of a real node with these arguments of ROS."""
    context = Context()
    rclpy.init(args=['--ros-args', *arguments], context=context)
    try:
        node = Node(name, context=context, automatically_declare_parameters_from_overrides=True)
        parameters: dict[str, Any] = node.get_parameters_by_prefix('')
        node.destroy_node()  # type: ignore[no-untyped-call]
        return {name: parameter.value for name, parameter in parameters.items()}
    finally:
        rclpy.shutdown(context=context)


def rate_of(name: str, ros: RosOptions) -> object:
    """Return the parameter ``rate`` of a real node with these options; None where it has none."""
    return parameters_of(name, *ros.node_arguments).get('rate')
