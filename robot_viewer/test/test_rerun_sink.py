# SPDX-FileCopyrightText: 2026 The arm and quad developers
# SPDX-License-Identifier: Apache-2.0
"""The sink as a process: what topics say is in a file that Rerun reads."""

from __future__ import annotations

from collections.abc import Iterator
from pathlib import Path
from typing import Any

from diagnostic_msgs.msg import DiagnosticArray, DiagnosticStatus
from geometry_msgs.msg import TransformStamped
from isolation import Isolation
from processes import executable, RunningProcess
import pytest
from rclpy.qos import DurabilityPolicy, QoSProfile
from ros_client import RosClient
from sensor_msgs.msg import JointState
from std_msgs.msg import String
from tf2_msgs.msg import TFMessage
import trimesh

pytest.importorskip('rerun', reason='`workspace build --with rerun robot_viewer` installs it')

pytestmark = pytest.mark.scenario

LATCHED = QoSProfile(depth=1, durability=DurabilityPolicy.TRANSIENT_LOCAL)
STAMP = 1_700_000_000  # [s]
URDF = """
<robot name="r">
  <link name="base"><visual><geometry><box size="0.2 0.2 0.1"/></geometry></visual></link>
  <joint name="lift" type="prismatic">
    <parent link="base"/> <child link="slide"/> <axis xyz="0 0 1"/>
    <limit lower="0" upper="1" velocity="1" effort="1"/>
  </joint>
  <link name="slide">
    <visual>
      <origin xyz="0 0 0.3"/> <geometry><mesh filename="{mesh}" scale="2 2 2"/></geometry>
    </visual>
  </link>
  <joint name="follower" type="prismatic">
    <parent link="slide"/> <child link="tip"/> <axis xyz="1 0 0"/>
    <limit lower="0" upper="1" velocity="1" effort="1"/> <mimic joint="lift" multiplier="2"/>
  </joint>
  <link name="tip"><visual><geometry><sphere radius="0.1"/></geometry></visual></link>
  <joint name="fixed" type="fixed"> <parent link="tip"/> <child link="lost"/> </joint>
  <link name="lost"><visual><geometry><mesh filename="none.stl"/></geometry></visual></link>
</robot>
"""


def rows(file: Path, entity: str, component: str) -> Iterator[tuple[int | None, Any]]:
    """Yield the values of a component with their time in [ns]; None for one of all times."""
    from rerun.chunk import RrdReader

    for chunk in RrdReader(str(file)).stream():
        if chunk.entity_path != entity:
            continue
        batch = chunk.to_record_batch()
        columns = {name: batch.column(name) for name in batch.schema.names}
        times = columns.get('ros_time')
        for name, column in columns.items():
            if name.endswith(component):
                for index, value in enumerate(column):
                    stamp = None if times is None else times[index].value
                    if value.is_valid:
                        yield stamp, value.as_py()


def sink(env: dict[str, str], to: object) -> RunningProcess:
    """Start a sink."""
    command = [executable('robot_viewer', 'rerun_sink'), '--ros-args', '-p', f'to:={to}']
    return RunningProcess(command, env)


def test_what_topics_say_is_in_a_file(isolation: Isolation, tmp_path: Path) -> None:
    """Links, numbers and texts, each with the time of its stamp; what is not shown is said."""
    trimesh.creation.box().export(tmp_path / 'mesh.stl')
    file = tmp_path / 'robot.rrd'
    with (
        RosClient(isolation.domain_id, 'robot') as robot,
        sink(isolation.env, file) as process,
    ):
        node = robot.node
        described = node.create_publisher(String, 'robot_description', LATCHED)
        states = node.create_publisher(JointState, 'joint_states', 10)
        frames = node.create_publisher(TFMessage, '/tf', 10)
        diagnostics = node.create_publisher(DiagnosticArray, 'diagnostics', 10)
        described.publish(String(data=URDF.format(mesh=(tmp_path / 'mesh.stl').as_uri())))
        process.wait_for('lost: .*none.stl')
        publishers = (states, frames, diagnostics)
        robot.spin_until(
            lambda: all(each.get_subscription_count() for each in publishers), 30.0, 'sink'
        )
        status = DiagnosticStatus(name='drive', level=DiagnosticStatus.WARN, message='is warm')
        for number in range(20):  # the first ones may come before the sink knows who sends them
            state = JointState(name=['lift'], position=[0.25], effort=[1.5])
            state.header.stamp.sec = STAMP + number
            states.publish(state)
            place = TransformStamped(child_frame_id='base')
            place.header.frame_id, place.header.stamp.sec = 'world', STAMP + number
            place.transform.translation.y = 3.0
            frames.publish(TFMessage(transforms=[place]))
            diagnostics.publish(DiagnosticArray(status=[status]))
            robot.spin_for(0.1)
        node.get_logger().warning('something happened')
        robot.spin_for(1.0)
        described.publish(String(data='<robot name="r"><link name="base"/></robot>'))
        robot.spin_for(1.0)
        assert process.stop() == 0, process.output
    last = (STAMP + 19) * 10**9
    assert (last, [0.25]) in rows(file, '/position/lift', 'scalars')
    assert (last, [1.5]) in rows(file, '/effort/lift', 'scalars')
    slide, tip = '/robot/base/slide', '/robot/base/slide/tip'
    assert (last, [[0.0, 0.0, 0.25]]) in rows(file, slide, 'translation')
    assert (last, [[0.5, 0.0, 0.0]]) in rows(file, tip, 'translation')
    assert (last, [[0.0, 3.0, 0.0]]) in rows(file, '/robot', 'translation')
    ((fixed, _),) = rows(file, f'{tip}/lost', 'translation')
    assert fixed is None, 'what never moves is there at all times'
    assert {time for time, _ in rows(file, slide, 'translation')} <= {
        (STAMP + number) * 10**9 for number in range(20)
    }
    (always, vertices), removed = rows(file, f'{slide}/shape1', 'vertex_positions')
    assert always is None
    assert removed == (None, []), 'another description has come'
    assert max(map(max, vertices)) == 1.0, 'half of a box of 1 m, twice'
    assert [each for _, each in rows(file, '/diagnostics', 'text')] == [['drive: is warm']]
    assert ['robot: something happened'] in [each for _, each in rows(file, '/log', 'text')]


@pytest.mark.parametrize(
    ('name', 'reason'),
    [
        ('robot.mcap', 'is neither a file that ends with .rrd nor the URL of a viewer'),
        ('none/robot.rrd', 'there is no folder'),
        ('there.rrd', 'is there already; give another name'),
    ],
)
def test_what_is_no_recording_is_refused(
    name: str, reason: str, isolation: Isolation, tmp_path: Path
) -> None:
    """Before anything is written."""
    (tmp_path / 'there.rrd').write_text('of somebody')
    with sink(isolation.env, tmp_path / name) as process:
        assert process.wait() == 1
        process.wait_for(reason)
    assert (tmp_path / 'there.rrd').read_text() == 'of somebody'
