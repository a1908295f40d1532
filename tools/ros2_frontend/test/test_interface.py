# SPDX-FileCopyrightText: 2026 The arm and quad developers
# SPDX-License-Identifier: Apache-2.0
"""`ros2 interface` over a made-up prefix and over the real interfaces."""

from __future__ import annotations

import io
import os
from pathlib import Path

from fake_prefix import add_package
from frontend_cli import Ros2
import pytest

TRANSFORM_STAMPED = """\
std_msgs/Header header
\tbuiltin_interfaces/Time stamp
\t\tint32 sec
\t\tuint32 nanosec
\tstring frame_id
"""
TRIGGER = """\
---
bool success   # indicate successful run of triggered service
string message # informational, e.g. for error messages
"""


@pytest.fixture
def demo(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """Put a package with one interface of each kind before the real ones."""
    definitions = {
        'action/Count.action': 'int32 order\n---\n---\n',
        'msg/Zebra.msg': '# long\nuint8 stripes\n',
        'msg/Ant.msg': '# six\n\nZebra[<=3] friends # of it\nuint8 LEGS=6\n',
        'srv/Feed.srv': '---\n',
    }
    add_package(tmp_path, 'demo_msgs', definitions=definitions)
    monkeypatch.setenv('AMENT_PREFIX_PATH', f'{tmp_path}:{os.environ["AMENT_PREFIX_PATH"]}')


@pytest.mark.usefixtures('demo')
def test_list_is_grouped_and_sorted(ros2: Ros2) -> None:
    """Messages, services, actions, each below its head; `-s` shows services only."""
    lines = ros2('interface', 'list').lines
    heads = [lines.index(head) for head in ('Messages:', 'Services:', 'Actions:')]
    assert heads == sorted(heads)
    assert lines.index('    demo_msgs/msg/Ant') + 1 == lines.index('    demo_msgs/msg/Zebra')
    assert lines.index('    demo_msgs/srv/Feed') > heads[1]
    assert lines.index('    demo_msgs/action/Count') > heads[2]
    assert lines[heads[2] + 1 :] == sorted(lines[heads[2] + 1 :])
    services = ros2('interface', 'list', '-s').lines
    assert services == lines[heads[1] : heads[2]]


@pytest.mark.usefixtures('demo')
def test_package_and_packages(ros2: Ros2) -> None:
    """The interfaces of one package, and the packages that have some."""
    assert ros2('interface', 'package', 'demo_msgs').lines == [
        'demo_msgs/action/Count',
        'demo_msgs/msg/Ant',
        'demo_msgs/msg/Zebra',
        'demo_msgs/srv/Feed',
    ]
    assert 'std_srvs' in ros2('interface', 'packages').lines
    assert 'std_srvs' not in ros2('interface', 'packages', '-m').lines
    packages = ros2('interface', 'packages', '-a').lines
    assert 'demo_msgs' in packages
    assert packages == sorted(packages)


@pytest.mark.usefixtures('demo')
def test_show_folds_nested_types_in(ros2: Ros2) -> None:
    """A type of the same package needs no package's name; comments and blank lines as asked."""
    shown = ros2('interface', 'show', 'demo_msgs/msg/Ant')
    own = '# six\n\nZebra[<=3] friends # of it\n{}\tuint8 stripes\nuint8 LEGS=6\n'
    assert shown.out == own.format('')
    everything = ros2('interface', 'show', 'demo_msgs/msg/Ant', '--all-comments')
    assert everything.out == own.format('\t# long\n')
    bare = ros2('interface', 'show', 'demo_msgs/msg/Ant', '--no-comments')
    assert bare.out == 'Zebra[<=3] friends\n\tuint8 stripes\nuint8 LEGS=6\n'


def test_show_real_definitions(ros2: Ros2) -> None:
    """Known ones, to the letter."""
    assert TRANSFORM_STAMPED in ros2('interface', 'show', 'sensor_msgs/msg/JointState').out
    assert ros2('interface', 'show', 'std_srvs/srv/Trigger').out == TRIGGER
    bare = ros2('interface', 'show', 'std_srvs/srv/Trigger', '--no-comments')
    assert bare.out == '---\nbool success\nstring message\n'


def test_show_reads_the_type_from_a_pipe(ros2: Ros2, monkeypatch: pytest.MonkeyPatch) -> None:
    """As in `ros2 topic type /chatter | ros2 interface show -`."""
    monkeypatch.setattr('sys.stdin', io.StringIO('std_srvs/srv/Trigger\n'))
    assert ros2('interface', 'show', '-').out == TRIGGER
    empty = ros2('interface', 'show', '-')
    assert (empty.code, empty.err) == (1, 'the passed value is empty\n')


def test_proto(ros2: Ros2) -> None:
    """Defaults of message and request as YAML, in quotes for a command line or without."""
    assert ros2('interface', 'proto', 'std_msgs/msg/String').out == '"data: \'\'\n"\n'
    request = ros2('interface', 'proto', 'std_srvs/srv/SetBool', '--no-quotes')
    assert request.out == 'data: false\n\n'


@pytest.mark.parametrize(
    ('words', 'first', 'near'),
    [
        (('package', 'std_msg'), "Unknown package 'std_msg'", "'std_msgs'"),
        (
            ('show', 'std_msgs/msg/Strin'),
            "Could not find the interface 'std_msgs/msg/Strin'",
            "'std_msgs/msg/String'",
        ),
        (
            ('show', 'std_msgs/String'),
            "Invalid name 'std_msgs/String'. Expected three parts separated by '/'",
            "'std_msgs/msg/String'",
        ),
        (('proto', 'std_srv/srv/Trigger'), "Unknown package 'std_srv'", "'std_srvs'"),
    ],
)
def test_what_is_not_there(ros2: Ros2, words: tuple[str, ...], first: str, near: str) -> None:
    """The reason and the nearest name, exit code 1."""
    outcome = ros2('interface', *words)
    assert (outcome.code, outcome.out) == (1, '')
    assert outcome.err.splitlines()[0] == first
    assert near in outcome.err.splitlines()[1]
