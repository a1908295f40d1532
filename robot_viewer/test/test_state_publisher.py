# SPDX-FileCopyrightText: 2026 The arm and quad developers
# SPDX-License-Identifier: Apache-2.0
"""Which transforms follow from which messages: as a library, as a node, and beside pinocchio."""

from __future__ import annotations

from collections.abc import Callable, Iterator, Mapping
import itertools
import math
from pathlib import Path
from typing import Any, TYPE_CHECKING

from hypothesis import given, settings
from hypothesis import strategies as st
import numpy as np
import numpy.typing as npt
import pinocchio
from processes import executable, RunningProcess
import pytest
from rcl_interfaces.msg import Parameter, ParameterType, ParameterValue
from rcl_interfaces.srv import SetParameters
from rclpy.qos import DurabilityPolicy, QoSProfile
from ros_client import RosClient
from sensor_msgs.msg import JointState
from std_msgs.msg import String
from tf2_msgs.msg import TFMessage
from urdf_reader import KinematicTree, read_urdf
from urdf_robots import ARM, POSITIONS, random_urdfs

from robot_viewer import FrameTransform, MessageProblem, Settings, StatePublisher
from robot_viewer.state_publisher import Update

if TYPE_CHECKING:
    from isolation import Isolation


LATCHED = QoSProfile(depth=1, durability=DurabilityPolicy.TRANSIENT_LOCAL)
SMALL = '<robot name="small"><link name="a"/><link name="b"/>{}</robot>'
FIXED = '<joint name="j" type="fixed"><parent link="a"/><child link="b"/></joint>'

StartNode = Callable[..., RunningProcess]


@pytest.fixture
def start(isolation: Isolation) -> Iterator[StartNode]:
    """Start the node with arguments."""
    running = []

    def start_node(*arguments: str) -> RunningProcess:
        command = [executable('robot_viewer', 'robot_state_publisher'), *arguments]
        running.append(RunningProcess(command, isolation.env))
        return running[-1]

    yield start_node
    for process in running:
        process.__exit__(None, None, None)


@pytest.fixture
def urdf(tmp_path: Path) -> Path:
    """Write the test arm to a file."""
    file = tmp_path / 'arm.urdf'
    file.write_text(ARM)
    return file


def frames(messages: list[TFMessage]) -> dict[str, Any]:
    """Return the last transform of each child frame."""
    return {each.child_frame_id: each for message in messages for each in message.transforms}


def set_parameter(client: RosClient, **values: str) -> Any:
    """Set string parameters of the node; return the first result."""
    parameters = [
        Parameter(
            name=name,
            value=ParameterValue(type=ParameterType.PARAMETER_STRING, string_value=value),
        )
        for name, value in values.items()
    ]
    request = SetParameters.Request(parameters=parameters)
    service = '/robot_state_publisher/set_parameters'
    return client.call(SetParameters, service, request).results[0]


@pytest.mark.scenario
def test_a_viewer_gets_description_fixed_and_moving_frames(
    start: StartNode, isolation: Isolation, urdf: Path
) -> None:
    """Latched for who comes late; a new description replaces the old one, a wrong one does not."""
    node = start(str(urdf), '--ros-args', '-p', 'publish_frequency:=100.0')
    node.wait_for('publishing 2 fixed and 5 moving frames')
    node.wait_until_ready()
    with RosClient(isolation.domain_id) as client:
        descriptions = client.listen(String, 'robot_description', LATCHED)
        static = client.listen(TFMessage, '/tf_static', LATCHED)
        moving = client.listen(TFMessage, '/tf', 100)
        publisher = client.node.create_publisher(JointState, 'joint_states', 10)
        message = JointState(name=list(POSITIONS), position=list(POSITIONS.values()))
        message.header.stamp.sec = 7

        def arrives() -> bool:
            publisher.publish(message)  # until the node has found the publisher
            return bool(moving)

        client.spin_until(lambda: bool(descriptions and static), 20.0, 'latched messages')
        client.spin_until(arrives, 20.0, '/tf')
        assert descriptions[0].data == ARM
        assert set(frames(static)) == {'camera', 'plate'}
        found = frames(moving)
        assert set(found) == {'upper', 'slider', 'wheel', 'finger', 'thumb'}
        assert found['upper'].header.frame_id == 'base'
        assert found['upper'].header.stamp.sec == 7
        assert found['thumb'].transform.translation.y == pytest.approx(0.3)

        refused = set_parameter(client, robot_description=SMALL.format(''))
        assert not refused.successful
        assert 'exactly one link must have no parent' in refused.reason
        assert set_parameter(client, robot_description=SMALL.format(FIXED)).successful
        client.spin_until(lambda: 'b' in frames(static), 20.0, 'the new description')
        assert set_parameter(client, frame_prefix='dog/').successful
        client.spin_until(lambda: 'dog/b' in frames(static), 20.0, 'the prefix')
    assert node.stop() == 0


@pytest.mark.scenario
@pytest.mark.parametrize(
    ('arguments', 'words'),
    [
        (['/nowhere.urdf'], 'nowhere.urdf.*No such file'),
        (['{broken}'], r'broken\.urdf: .*no <link>'),
    ],
    ids=['no file', 'broken file'],
)
def test_what_cannot_work_ends_at_once_with_the_reason(
    start: StartNode, tmp_path: Path, arguments: list[str], words: str
) -> None:
    """Exit code 1, one line, no traceback."""
    broken = tmp_path / 'broken.urdf'
    broken.write_text('<robot/>')
    node = start(*(word.format(broken=broken) for word in arguments))
    node.wait_for(words)
    assert node.wait() == 1
    assert 'Traceback' not in node.output


Matrix = npt.NDArray[np.float64]

angle = st.floats(-7.0, 7.0, allow_nan=False)


def matrix_of(named: FrameTransform) -> Matrix:
    """Make a homogeneous matrix of a transform."""
    pose = np.eye(4)
    pose[:3, :3] = pinocchio.Quaternion(np.array(named.transform.rotation)).toRotationMatrix()
    pose[:3, 3] = named.transform.translation
    return pose


def published(model: KinematicTree, positions: Mapping[str, float]) -> dict[str, FrameTransform]:
    """Return what is published of a robot, by child frame."""
    core = StatePublisher(model, Settings())
    update = core.update(list(positions), list(positions.values()), 10**9, 10**9)
    return {each.child: each for each in [*core.fixed(), *update.transforms]}


def pose_in_root(link: str, root: str, frames: Mapping[str, FrameTransform]) -> Matrix:
    """Chain transforms from the root to a link, as a listener of /tf does."""
    pose = np.eye(4)
    while link != root:
        pose = matrix_of(frames[link]) @ pose
        link = frames[link].parent
    return pose


def pinocchio_positions(
    model: pinocchio.Model, positions: Mapping[str, float]
) -> npt.NDArray[np.float64]:
    """Fill pinocchio's vector; its continuous joints are cosine and sine."""
    q: npt.NDArray[np.float64] = pinocchio.neutral(model)
    for name, value in positions.items():
        joint = model.joints[model.getJointId(name)]
        if joint.nq == 2:
            q[joint.idx_q : joint.idx_q + 2] = math.cos(value), math.sin(value)
        else:
            q[joint.idx_q] = value
    return q


@pytest.mark.slow
@given(random_urdfs(), st.lists(angle, min_size=7, max_size=7))
@settings(max_examples=60)
def test_every_link_is_where_pinocchio_has_it(urdf: str, values: list[float]) -> None:
    """For random trees, origins, axes and positions, to 1e-9 m and rad."""
    model = read_urdf(urdf)
    positions = dict(zip((joint.name for joint in model.movable()), values, strict=False))
    frames = published(model, positions)
    assert set(frames) == set(model.links) - {model.root}
    reference = pinocchio.buildModelFromXML(urdf)
    data = reference.createData()
    pinocchio.framesForwardKinematics(reference, data, pinocchio_positions(reference, positions))
    for link in model.links:
        expected = data.oMf[reference.getFrameId(link)].homogeneous
        np.testing.assert_allclose(
            pose_in_root(link, model.root, frames), expected, atol=1e-9, err_msg=link
        )


MS = 1_000_000
"""A millisecond in [ns]."""
START = 10**18


def publisher(**options: object) -> StatePublisher:
    """Make one of the test arm."""
    return StatePublisher(read_urdf(ARM), Settings(**options))  # type: ignore[arg-type]


def send(core: StatePublisher, stamp: int, **positions: float) -> Update:
    """Send a message that arrives when it was stamped."""
    positions = positions or POSITIONS
    return core.update(list(positions), list(positions.values()), stamp, stamp)


def children(update: Update) -> set[str]:
    """Names of the frames that were published."""
    return {each.child for each in update.transforms}


def test_which_frames_are_published() -> None:
    """Fixed and planar joints once; floating ones are left out, as in the public publisher."""
    core = publisher(frame_prefix='dog_')
    assert {each.child for each in core.fixed()} == {'dog_camera', 'dog_plate'}
    update = send(core, START, shoulder=0.1, of_another_robot=1.0)
    assert [(each.parent, each.child) for each in update.transforms] == [('dog_base', 'dog_upper')]
    assert (update.stamp, update.problems) == (START, ())


@pytest.mark.parametrize(
    ('positions', 'thumb'),
    [
        (POSITIONS, [(0.0, pytest.approx(-2 * 0.1 + 0.5), 0.0)]),  # multiplier and offset
        ({'shoulder': 0.0}, []),  # not without its source
        ({'finger_joint': 0.1, 'thumb_joint': 0.7}, [(0.0, 0.7, 0.0)]),  # measured, and once
    ],
)
def test_a_joint_that_follows_is_published_with_its_source(
    positions: dict[str, float], thumb: list[Any]
) -> None:
    """Where its own position comes, that counts."""
    update = send(publisher(), START, **positions)
    assert [e.transform.translation for e in update.transforms if e.child == 'thumb'] == thumb


def test_messages_that_come_too_often_are_passed_over() -> None:
    """50 Hz become 50 transforms in 3 s at 20 Hz: one in 60 ms, the first multiple above 50."""
    core = publisher(publish_frequency=20.0)
    stamps = [START + 20 * MS * index for index in range(150)]
    sent = [stamp for stamp in stamps if send(core, stamp).transforms]
    assert {after - before for before, after in itertools.pairwise(sent)} == {60 * MS}


@given(st.floats(0.5, 1000.0), st.lists(st.integers(1, 400 * MS), min_size=2, max_size=30))
def test_transforms_of_a_joint_are_never_closer_than_the_interval(
    frequency: float, gaps: list[int]
) -> None:
    """And no message is passed over that comes later than that."""
    core = publisher(publish_frequency=frequency)
    stamp, last = START, None
    for gap in gaps:
        stamp += gap
        if send(core, stamp, shoulder=0.0).transforms:
            assert last is None or stamp - last >= core.settings.interval
            last = stamp
        else:
            assert last is not None
            assert stamp - last < core.settings.interval


def test_the_joint_that_waited_longest_decides() -> None:
    """A message with one new joint is published whole."""
    core = publisher()
    send(core, START, shoulder=0.0)
    assert not send(core, START + MS, shoulder=0.0).transforms
    assert children(send(core, START + 2 * MS, shoulder=0.0, lift=0.0)) == {'upper', 'slider'}


@pytest.mark.parametrize(
    'options', [{'publish_frequency': 0.0}, {'ignore_timestamp': True}], ids=['0 Hz', 'ignored']
)
def test_every_message_is_published_where_that_is_wanted(options: dict[str, object]) -> None:
    """With equal stamps, too."""
    core = publisher(**options)
    assert all(send(core, START).transforms for _ in range(3))


@pytest.mark.parametrize('frequency', [-1.0, 1000.1, math.nan])
def test_a_frequency_that_is_none_is_refused(frequency: float) -> None:
    """Also of the library, which has no parameters of a node."""
    with pytest.raises(ValueError, match='give 0 to 1000 Hz'):
        Settings(publish_frequency=frequency)


def test_a_clock_that_jumps_back_begins_anew() -> None:
    """A bag that is played in a loop; where only the stamp is old, it is passed over."""
    core = publisher()
    send(core, START)
    names, positions = list(POSITIONS), list(POSITIONS.values())
    late = core.update(names, positions, START - 5 * MS, START + MS)
    assert (late.transforms, late.problems) == ((), ())
    update = send(core, START // 2)
    assert update.transforms
    assert update.problems == (MessageProblem.BACKWARDS,)


def test_a_message_without_stamp_gets_the_time_of_its_arrival() -> None:
    """A transform of the year 1970 is of no use to anybody."""
    update = publisher().update(['shoulder'], [0.0], 0, START)
    assert update.stamp == START
    assert update.problems == (MessageProblem.NO_STAMP,)
    assert update.transforms


@pytest.mark.parametrize(
    ('positions', 'problem'),
    [
        ([], MessageProblem.NO_POSITION),
        ([0.0], MessageProblem.LENGTHS),
        ([0.0] * 3, MessageProblem.LENGTHS),
    ],
)
def test_a_message_with_the_wrong_lengths_is_ignored(
    positions: list[float], problem: MessageProblem
) -> None:
    """And said so; the next good one is published."""
    core = publisher()
    update = core.update(['shoulder', 'lift'], positions, START, START)
    assert update == Update(START, (), (problem,))
    assert send(core, START + MS).transforms


@pytest.mark.parametrize('value', [math.nan, math.inf])
def test_a_position_that_is_not_finite_is_left_out(value: float) -> None:
    """The others are published; NaN in /tf breaks whoever listens."""
    update = send(publisher(), START, shoulder=value, lift=0.1)
    assert children(update) == {'slider'}
    assert update.problems == (MessageProblem.NOT_FINITE,)
