# SPDX-FileCopyrightText: 2026 The arm and quad developers
# SPDX-License-Identifier: Apache-2.0
"""What a newcomer does with the quadruped: the article's commands, and the demo."""

from __future__ import annotations

from typing import TYPE_CHECKING

from processes import RunningProcess
import psutil
import pytest
from ros_client import RosClient
from tf2_msgs.msg import TFMessage

from node_runner import LATCHED
from quad_description import LEGS

if TYPE_CHECKING:
    from collections.abc import Sequence

    from isolation import Isolation

pytestmark = pytest.mark.scenario

STARTING = 60.0
"""Longest time in [s] until all is ready on a busy machine."""
SET_MODE = ('service', 'call', '/set_mode', 'quad_msgs/srv/SetMode')


def start(isolation: Isolation, *arguments: str) -> RunningProcess:
    """Start an executable of quad_bringup by ``ros2 run``."""
    return RunningProcess(['ros2', 'run', 'quad_bringup', *arguments], isolation.env)


def ros2(isolation: Isolation, *arguments: str) -> str:
    """Run a ros2 command to its end and return what it printed."""
    with RunningProcess(['ros2', *arguments], isolation.env) as process:
        assert process.wait(STARTING) == 0, process.output
        return process.output


def tree(messages: Sequence[TFMessage]) -> dict[str, str]:
    """Return the parent of each frame."""
    return {
        each.child_frame_id: each.header.frame_id
        for message in messages
        for each in message.transforms
    }


def expected_tree() -> dict[str, str]:
    """Return the article's frames: the parent of each."""
    legs = {
        f'{leg}_{part}': f'{leg}_{above}' if above else 'base_link'
        for leg in LEGS
        for part, above in (('hip', ''), ('thigh', 'hip'), ('calf', 'thigh'), ('foot', 'calf'))
    }
    body = {'base_link': 'odom', 'base_footprint': 'base_link', 'imu_link': 'base_link'}
    return body | legs


def test_every_frame_of_the_article_is_there(isolation: Isolation) -> None:
    """And Ctrl-C lays a robot down that stands; the article's commands are those of the manual."""
    with start(isolation, 'bringup', '--simulate') as bringup:
        bringup.wait_for('all is ready', STARTING)
        started = psutil.Process(bringup.pid).children(recursive=True)
        assert 'success=True' in ros2(isolation, *SET_MODE, '{mode: stand}')
        check_frames(isolation)
        assert bringup.stop(STARTING) == 0, bringup.output
    assert 'lying down first' in bringup.output
    assert 'without lying down' not in bringup.output
    assert not psutil.wait_procs(started, timeout=5.0)[1]


def check_frames(isolation: Isolation) -> None:
    """Every frame of the article is there, below the right parent."""
    with RosClient(isolation.domain_id) as client:
        moving = client.listen(TFMessage, '/tf', 100)
        static = client.listen(TFMessage, '/tf_static', LATCHED)
        wanted = expected_tree().items()
        client.spin_until(lambda: wanted <= tree([*moving, *static]).items(), 20.0, 'all frames')
