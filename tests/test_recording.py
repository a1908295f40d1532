# SPDX-FileCopyrightText: 2026 The arm and quad developers
# SPDX-License-Identifier: Apache-2.0
"""Arm and quadruped move together and are recorded: nothing is missing silently."""

from __future__ import annotations

from collections import Counter
from pathlib import Path
import re

from frontend_cli import PROGRAM, with_frontend
from isolation import Isolation
from mcap.reader import make_reader
from mcap_ros2.decoder import DecoderFactory
from processes import RunningProcess
import pytest
from rosbags.rosbag2 import Reader
from simulated_arm import JOINTS, SimulatedArm
from simulated_quad import SimulatedQuad

pytestmark = [pytest.mark.scenario, pytest.mark.slow]

DURATION = 10.0  # [s] of walking
RATE = 30.0  # [1/s]; what a topic of a cycle has at least
SEVERAL = {'/rosout', '/parameter_events', '/diagnostics', '/tf', '/tf_static'}
"""Topics that several nodes publish."""


def sequences(file: Path) -> dict[str, list[int]]:
    """Return the numbers that DDS gave the messages of each topic; every one is decoded."""
    found: dict[str, list[int]] = {}
    with file.open('rb') as stream:
        reader = make_reader(stream, decoder_factories=[DecoderFactory()])
        for _, channel, message, decoded in reader.iter_decoded_messages():
            assert decoded is not None
            found.setdefault(channel.topic, []).append(message.sequence)
    return found


def runs(numbers: list[int]) -> int:
    """Count how many unbroken rows numbers make: one for each publisher that lost nothing."""
    ends: Counter[int] = Counter()
    count = 0
    for number in numbers:
        if ends[number - 1]:
            ends[number - 1] -= 1
        else:
            count += 1
        ends[number] += 1
    return count


def reported(output: str) -> dict[str, int]:
    """Return what the recorder says it has missed: where other processes starve it, DDS drops."""
    lines = re.findall(r'messages never arrived at the recorder: (.*)', output)
    pairs = [pair.split(': ') for line in lines for pair in line.split(', ')]
    return {name: int(count) for name, count in pairs}


def test_all_of_arm_and_quadruped_is_recorded(isolation: Isolation, tmp_path: Path) -> None:
    """Every message is there or reported as lost; two readers that are not ours agree."""
    folder = tmp_path / 'bag'
    with (
        SimulatedArm(isolation) as arm,
        SimulatedQuad(isolation, tmp_path, tapped=False) as quad,
        RunningProcess(
            [*PROGRAM, 'bag', 'record', '-a', '-o', str(folder)], with_frontend(isolation.env)
        ) as recorder,
    ):
        recorder.wait_for('Recording...')
        arm.init_all()
        quad.stand()
        quad.walk(DURATION)
        assert recorder.stop(30.0) == 0
    assert 'dropped' not in recorder.output
    lost = reported(recorder.output)
    numbers = sequences(folder / 'bag_0.mcap')
    with Reader(folder) as reader:
        assert {
            name: topic.msgcount for name, topic in reader.topics.items() if topic.msgcount
        } == {name: len(each) for name, each in numbers.items()}
    cyclic = ['/joint_states', '/imu', *(f'/{joint}/joint_states' for joint in JOINTS)]
    for name in cyclic:
        assert len(numbers[name]) > DURATION * RATE, name
    for name in set(numbers) - SEVERAL:
        found = numbers[name]
        assert found == sorted(set(found)), name
        assert found[-1] - found[0] + 1 == len(found) + lost.get(name, 0), name
    nodes = len(JOINTS) + 10
    for name in SEVERAL & set(numbers):
        assert lost or runs(numbers[name]) <= nodes, name
