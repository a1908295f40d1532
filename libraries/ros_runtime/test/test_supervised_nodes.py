# SPDX-FileCopyrightText: 2026 The arm and quad developers
# SPDX-License-Identifier: Apache-2.0
"""ROS nodes as processes."""

from __future__ import annotations

from pathlib import Path

import pytest
import yaml

from process_supervisor import (
    EVERY_NODE,
    Executable,
    node_argv,
    ros_domain,
    StartError,
    write_parameters,
)
from process_supervisor.nodes import first_found

NODE = Executable('some_package', 'some_node')


def test_parameters_reach_the_command_line(tmp_path: Path) -> None:
    """The file first, so that single values win over it."""
    file = tmp_path / 'some_node'
    file.touch(mode=0o755)
    argv = node_argv(NODE, lambda package, name: tmp_path / name, {'a': '1'}, [Path('p.yaml')])
    assert argv == (str(file), '--ros-args', '--params-file', 'p.yaml', '-p', 'a:=1')


def test_a_workspace_that_is_not_built_is_reported(tmp_path: Path) -> None:
    """A missing package and a missing executable are distinguished."""
    with pytest.raises(StartError, match=r'some_package is not in .*; source env.sh.*make build'):
        node_argv(NODE, lambda package, name: None)
    with pytest.raises(StartError, match=r'some_node does not exist.*make build'):
        node_argv(NODE, lambda package, name: tmp_path / name)


def test_the_first_that_exists_is_taken(tmp_path: Path) -> None:
    """The best first; none when there is none."""
    other = Executable('other', 'some_node')
    assert first_found([NODE, other], lambda package, name: tmp_path) is NODE
    found = first_found(
        [NODE, other], lambda package, name: tmp_path if package == 'other' else None
    )
    assert found is other
    assert first_found([NODE, other], lambda package, name: None) is None


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
