# SPDX-FileCopyrightText: 2026 The arm and quad developers
# SPDX-License-Identifier: Apache-2.0
"""The forms in which `ros2 topic echo` prints a message, without DDS."""

from __future__ import annotations

from argparse import ArgumentParser
from types import SimpleNamespace

import pytest
from sensor_msgs.msg import JointState

from ros2_frontend.cli.commands import FrontendError
from ros2_frontend.verbs.topic_echo import echo, print_lost, printer

INFO = {'source_timestamp': 11, 'received_timestamp': 12, 'publication_sequence_number': 3}


def printed(capsys: pytest.CaptureFixture[str], *options: str) -> str:
    """Print one message with the options of a command line."""
    parser = ArgumentParser()
    for add in echo.arguments:
        add(parser)
    message = JointState(name=['one', 'two'], position=[0.5, -1.0])
    message.header.stamp.sec = 7
    message.header.frame_id = 'base'
    printer(parser.parse_args(['/joint_states', *options]))(message, INFO)
    return capsys.readouterr().out


@pytest.mark.parametrize(
    ('options', 'expected'),
    [
        ('--field name', "['one', 'two']\n---\n"),
        ('--field position', "array('d', [0.5, -1.0])\n---\n"),
        ('--field header.frame_id', 'base\n---\n'),
        ('--field header.stamp', 'sec: 7\nnanosec: 0\n---\n'),
        ('--field position.[1]', '-1.0\n---\n'),
        ('--field position[-1]', '-1.0\n---\n'),
        ('--field .header.stamp.sec.', '7\n---\n'),
        ('--csv', '7,0,base,one,two,0.5,-1.0,,\n'),
        ('--csv -i', '11,12,3,7,0,base,one,two,0.5,-1.0,,\n'),
        ('--flow-style --field header', '{stamp: {sec: 7, nanosec: 0}, frame_id: base}\n---\n'),
        ('--no-str --field header.stamp', 'sec: 7\nnanosec: 0\n---\n'),
        ('--filter m.position[1]>0', ''),
        ('--field name --filter len(m)==2', "['one', 'two']\n---\n"),
    ],
)
def test_forms(capsys: pytest.CaptureFixture[str], options: str, expected: str) -> None:
    """Each option has its form, to the letter."""
    assert printed(capsys, *options.split()) == expected


@pytest.mark.parametrize(
    ('options', 'part'),
    [
        ('--no-arr', "name: '<sequence type: string, length: 2>'\nposition: '<sequence"),
        ('--no-str', "  frame_id: '<string length: <4>>'\nname:\n- '<string length: <3>>'\n"),
        ('-l 1', "  frame_id: b...\nname:\n- o...\n- '...'\nposition:\n- 0.5\n- '...'\n"),
        ('-l 1 -f', '  frame_id: base\nname:\n- one\n- two\n'),
        ('-i', 'publication_sequence_number: 3\nreceived_timestamp: 12\nsource_timestamp: 11\n'),
        ('-i', 'source_timestamp: 11\n---\nheader:\n'),
        ('-i --field name', '---Got new message, message info:---\n{'),
    ],
)
def test_parts(capsys: pytest.CaptureFixture[str], options: str, part: str) -> None:
    """What an option leaves out or adds."""
    assert part in printed(capsys, *options.split())


@pytest.mark.parametrize(
    ('options', 'problem'),
    [
        (
            '--field nam',
            "Invalid field 'nam': 'JointState' object has no attribute 'nam'\nIt has: header",
        ),
        ('--field header.zzz', "'Header' object has no attribute 'zzz'\nIt has: stamp, frame_id"),
        ('--field name.[5]', 'Invalid field .* index out of range'),
        ('--field header.[0]', "'Header' object is not subscriptable"),
        ('--field ...', 'Invalid field value'),
        ('--filter m.+', r"Invalid filter 'm\.\+'"),
        ('--filter m.nothing', r"Filter 'm.nothing' failed: .*no attribute"),
    ],
)
def test_a_path_or_filter_that_fails_says_how(
    capsys: pytest.CaptureFixture[str], options: str, problem: str
) -> None:
    """It says how far it went and what is there."""
    with pytest.raises(FrontendError, match=problem):
        printed(capsys, *options.split())


def test_lost_messages(capsys: pytest.CaptureFixture[str]) -> None:
    """How many now and how many in all."""
    print_lost(SimpleNamespace(total_count_change=2, total_count=5))
    expected = 'A message was lost!!!\n\ttotal count change:2\n\ttotal count: 5---\n'
    assert capsys.readouterr().out == expected
