# SPDX-FileCopyrightText: 2026 The arm and quad developers
# SPDX-License-Identifier: Apache-2.0
"""The scene of the planner, and where joints are, for the groups that are moved here.

A group that moves by itself (another arm) is checked against where it came to rest; while it
moves, :class:`MovingArms` keeps the two apart. Other joints beside the group (a gripper, a neck, a
lift) are checked where they are, or were half a second ago.
"""

from __future__ import annotations

from collections import deque
from collections.abc import Callable, Collection, Iterable, Mapping, Sequence
from concurrent.futures import Executor, ThreadPoolExecutor
from dataclasses import dataclass, field
from functools import partial
import math
import time
from typing import Any

from moveit_msgs.msg import PlanningScene
from moveit_msgs.srv import GetPlanningScene
from rclpy.event_handler import SubscriptionEventCallbacks
from rclpy.node import Node
from rclpy.serialization import deserialize_message
from sensor_msgs.msg import JointState
from urdf_reader import Pair

from arm_model import ArmError, Array, RobotModel
from arm_model import PlanningScene as Scene
from arm_model.ros import apply_planning_scene
from node_runner import LATCHED
from robot_primitives import JointStateStore

from ..controllers.controller import Source
from ..core.gateway import CommandGateway
from ..core.safety_filter import MovingArms
from .motion_goals import LoggedReasons

SceneChange = Callable[[Scene, Array], Scene]
"""Makes a scene of the one before and the positions of the group's joints in [rad]."""

MOVING_PERIOD = 0.5  # time between two scenes for a joint beside the group that moves in [s]

PLACE_TOLERANCE = 1e-3
"""How far a joint that stands still may seem to move in [rad] or [m]: noise of its sensor."""


@dataclass(frozen=True, slots=True)
class JointPlaces:
    """One look at the joints of a robot."""

    # where they are in [rad] or [m], by joint
    places: Mapping[str, float] = field(default_factory=dict)
    moving: Collection[str] = frozenset()  # those that move

    def next(self, places: Mapping[str, float], commanded: Collection[str]) -> JointPlaces:
        """Return the next look; a joint that was not there before counts as one that moves."""
        moved = {
            joint
            for joint, place in places.items()
            if not abs(place - self.places.get(joint, math.nan)) <= PLACE_TOLERANCE
        }
        return JointPlaces(places, moved.union(commanded))


class SceneUpdater:
    """Has the newest scene count for one group, as it is with the joints beside the group.

    :meth:`change` is for one thread, :meth:`update` for another: it takes as long as it needs.
    """

    def __init__(
        self,
        gateway: CommandGateway,
        arms: Mapping[str, Sequence[str]],  # joints of the arms that move by themselves, by group
        moving: MovingArms | None = None,
    ) -> None:
        self.gateway = gateway
        self._moving = moving
        model = gateway.model
        self._scene = self._planned = model.scene
        self._moved_by_others = model.moved_by_others
        self._arms = {group: arms[group] for group in self._moved_by_others}
        self._unchecked = self._moved_by(self._arms)
        if self._unchecked:
            self._planned = model.scene.with_allowed(model.allowed)
        self._moved = -math.inf
        self._changes: deque[SceneChange] = deque()  # the last whole scene, and those after it

    @property
    def waits(self) -> bool:
        """Whether a scene does not count yet."""
        return bool(self._changes)

    @property
    def others(self) -> Mapping[str, float]:
        """Where the joints beside the group count in [rad], by joint."""
        return self._planned.kinematics.others

    @property
    def is_placed(self) -> bool:
        """Whether it is known where the group is, so that a scene can be applied."""
        return self.gateway.snapshot.reference is not None

    def change(self, change: SceneChange, *, is_whole: bool) -> None:
        """Change the scene after the changes that wait; a whole scene replaces those."""
        if is_whole:
            self._changes = deque([change])
        else:
            self._changes.append(change)

    def update(self, joints: JointPlaces, now: float) -> None:
        """Apply the next change, if it is known where the group is.

        An equal scene changes nothing.

        Raises:
            ArmError: The scene is refused; the one before counts.
        """
        reference = self.gateway.snapshot.reference
        if reference is None:
            return
        moved = self._planned.kinematics.with_others(self._elsewhere(joints, now))
        planned = self._planned.with_others(moved)
        changes = self._changes  # another thread may replace them
        if changes:
            planned = changes.popleft()(planned, reference.position)
        unchecked = self._moved_by(
            group
            for group, names in self._arms.items()
            if any(name in joints.moving or name not in joints.places for name in names)
        )
        if planned is self._planned and unchecked == self._unchecked:
            return
        if self._moving is not None:
            self._moving.use_scene(planned)
        self._planned, self._unchecked = planned, unchecked
        scene = planned
        if unchecked:
            scene = planned.with_allowed(planned.allowed.with_entries(unchecked, True))
        if not scene.is_same(self._scene):
            self.gateway.use_scene(scene)
            self._scene = scene

    def _moved_by(self, groups: Iterable[str]) -> frozenset[Pair]:
        """Return the pairs of links that groups move."""
        return frozenset().union(*(self._moved_by_others[group] for group in groups))

    def _elsewhere(self, joints: JointPlaces, now: float) -> Mapping[str, float]:
        """Return the joints beside the group that count where they are not any more."""
        of_arms = {name for names in self._arms.values() for name in names}
        waits = now - self._moved < MOVING_PERIOD
        found = {
            joint: joints.places[joint]
            for joint, place in self.others.items()
            if joint in joints.places
            and abs(joints.places[joint] - place) > PLACE_TOLERANCE
            and not (joint in joints.moving and (waits or joint in of_arms))
        }
        if found:
            self._moved = now
        return found


TOPIC = 'collision_scene'
"""Where move_group of arm_planning publishes what may collide, latched: after each change, meshes
as the hulls that it has made, for programs that have a control cycle to keep."""

FOREIGN_TOPIC = 'monitored_planning_scene'
"""Where any move_group publishes its scene; it counts where nothing publishes the other topic."""

FOREIGN_DEPTH = 100  # messages of MoveIt's monitor that may wait, as it keeps as many

ASK_AFTER = 1.0  # time from the start in [s] in which a whole scene may come by itself

LOOK_PERIOD = 0.1  # time between two looks where the joints are in [s]
ANSWER_TIMEOUT = 5.0
"""Time in [s] for which a whole scene is awaited before it is requested again, and missed."""

PLACE_TIMEOUT = 1.0  # time for which a scene waits for a group's position without a warning in [s]
OTHERS_TIMEOUT = 5.0  # time for which joints beside a group are awaited without a warning in [s]


class SceneListener:
    """Applies scenes and diffs to all groups, with the joints beside them where they are.

    Scenes are built and measured in a thread of their own: neither the executor nor a cycle waits.
    What is refused is logged, once while it comes again and again.
    """

    def __init__(
        self,
        node: Node,
        # commands to the core of each group that is checked for collision
        gateways: Sequence[CommandGateway],
        # the same of the other groups, which the checked ones may meet
        unchecked: Sequence[CommandGateway] = (),
        *,
        joint_topic: str = 'joint_states',
        # builds the scenes, one after the other; by default a thread
        worker: Executor | None = None,
        clock: Callable[[], float] = time.monotonic,
    ) -> None:
        """Subscribe; to joint states only where there are joints besides those of the groups."""
        self._node, self._clock = node, clock
        self._worker = worker or ThreadPoolExecutor(1, thread_name_prefix='scenes')
        arms = {gateway.model.group: gateway.model.joints for gateway in gateways}
        free = [gateway for gateway in gateways if gateway.model.moved_by_others]
        moving = MovingArms([gateway.model for gateway in free]) if free else None
        if moving is not None:  # arms that move by themselves know of each other
            for gateway in free:
                gateway.keep_apart(moving.neighbours(gateway.model.joints))
        self._updaters = [
            SceneUpdater(gateway, arms, None if number else moving)
            for number, gateway in enumerate(gateways)
        ]
        # a whole scene that is refused is requested again, and is one that is in the log
        self._logged = {each: LoggedReasons(2.0 * ANSWER_TIMEOUT) for each in self._updaters}
        self._gateways = [*gateways, *unchecked]
        self._begin = self._received = clock()
        self._is_complete = False  # whether a whole scene came, and none was refused
        self._early = deque[PlanningScene](maxlen=FOREIGN_DEPTH)  # diffs since it was requested
        self._answer: Any = None  # the one that is awaited
        self._due = self._begin + ASK_AFTER  # when it is requested next
        self._missed = math.inf  # since when it is known to be missing
        self._client = node.create_client(GetPlanningScene, 'get_planning_scene')
        self._unplaced = list(self._updaters)  # those of which no warning has said so
        self._assuming = list(self._updaters)  # the same for joints beside them
        self._placed: dict[SceneUpdater, float] = {}  # since when
        self._joints = JointPlaces()
        commanded = {name for gateway in self._gateways for name in gateway.model.joints}
        awaited = {name for each in self._updaters for name in each.others} - commanded
        self._states = JointStateStore(awaited)
        node.create_subscription(PlanningScene, TOPIC, self._take, LATCHED)
        # MoveIt's monitor does not latch it. A latched subscription gets nothing of that, and says
        # so; one that is not gets no scene that was latched before. Raw: its meshes take long to
        # read, which is left out where they have no use
        silent = SubscriptionEventCallbacks(use_default_callbacks=False)
        for callback, qos in (
            (self._take_foreign, LATCHED),
            (self._take_volatile, FOREIGN_DEPTH),
        ):
            node.create_subscription(
                PlanningScene, FOREIGN_TOPIC, callback, qos, raw=True, event_callbacks=silent
            )
        if awaited:
            node.create_subscription(JointState, joint_topic, self._take_joints, 10)
        node.create_timer(LOOK_PERIOD, self._look)

    def _take_volatile(self, data: bytes) -> None:
        """Take a scene that comes in no other way."""
        publishers = self._node.get_publishers_info_by_topic(FOREIGN_TOPIC)
        if all(each.qos_profile.durability != LATCHED.durability for each in publishers):
            self._take_foreign(data)

    def _take_foreign(self, data: bytes) -> None:
        if not self._node.count_publishers(TOPIC):
            self._take(deserialize_message(data, PlanningScene))

    def _ask(self) -> None:
        """Request the whole scene, until it comes, of a move_group that began before this node."""
        now = self._clock()
        if self._is_complete or now < self._due:
            return
        if self._client.service_is_ready() and not self._node.count_publishers(TOPIC):
            if self._answer is not None:  # nothing may answer it any more
                self._answer.cancel()
            self._early.clear()  # the answer has what was published before
            self._due, self._missed = now + ANSWER_TIMEOUT, min(self._missed, now)
            self._answer = self._client.call_async(GetPlanningScene.Request())
            self._answer.add_done_callback(self._answered)

    def _answered(self, answer: Any) -> None:  # noqa: ANN401  # rclpy has no types here
        if self._is_complete or answer.cancelled() or answer.exception() is not None:
            return
        response = answer.result()
        response.scene.is_diff = False
        for message in (response.scene, *self._early):  # it may be older than those
            self._take(message)

    def _take(self, message: PlanningScene) -> None:
        self._received = self._clock()
        if not message.is_diff:
            self._is_complete, self._missed = True, math.inf
        elif not self._is_complete:
            self._early.append(message)
            self._missed = min(self._missed, self._received)
        for updater in self._updaters:
            model = updater.gateway.model
            updater.change(partial(self._change, message, model), is_whole=not message.is_diff)
        self._submit()

    def _change(
        self, message: PlanningScene, model: RobotModel, scene: Scene, positions: Array
    ) -> Scene:
        """Apply a message; in the thread of the scenes."""
        try:
            return apply_planning_scene(scene, message, positions, world_frames=model.world_frames)
        except Exception:
            if not message.is_diff:
                self._is_complete = False  # it is requested again
            raise

    def _take_joints(self, message: JointState) -> None:
        self._states.receive(message.name, message.position, [], self._clock())

    def _look(self) -> None:
        """Read where the joints are, and submit what is new."""
        places = {name: each.position for name, each in self._states.samples().items()}
        commanded = set[str]()
        for gateway in self._gateways:
            snapshot, names = gateway.snapshot, gateway.model.joints
            reference = snapshot.reference
            if reference is not None:
                places.update(zip(names, reference.position.tolist(), strict=True))
                if snapshot.source is not Source.NONE or reference.moving:
                    commanded.update(names)
        self._joints = self._joints.next(places, commanded)
        self._ask()
        self._submit()
        self._warn_of_whole()
        self._warn_of_groups()
        self._warn_of_others()

    def _submit(self) -> None:
        joints, now = self._joints, self._clock()
        for updater in self._updaters:
            if updater.is_placed and (updater.waits or updater.others):
                self._worker.submit(self._update, updater, joints, now)

    def _update(self, updater: SceneUpdater, joints: JointPlaces, now: float) -> None:
        """Apply what is new for a group; in the thread of the scenes."""
        try:
            updater.update(joints, now)
        except Exception as error:  # noqa: BLE001  # a scene must not end the thread
            reason = (
                str(error) if isinstance(error, ArmError) else f'{type(error).__name__}: {error}'
            )
            if self._logged[updater].is_new(reason, now):
                self._node.get_logger().error(
                    f'{TOPIC} refused for {updater.gateway.model.group}, the scene before counts:'
                    f' {reason}'
                )

    def _warn_of_whole(self) -> None:
        """Say that objects may be missing."""
        if not self._is_complete and self._clock() - self._missed > ANSWER_TIMEOUT:
            self._node.get_logger().warning(
                f'{FOREIGN_TOPIC}: no whole scene came in {ANSWER_TIMEOUT:g} s: only what diffs'
                ' (is_diff) name counts, and objects that were there before them do not; start'
                ' this node before move_group, or have move_group answer get_planning_scene or'
                ' publish a whole scene',
                once=True,
            )

    def _warn_of_groups(self) -> None:
        """Name once each group for which a scene waits, as it is not known where it is."""
        for updater in self._unplaced.copy():
            waited = self._clock() - self._received
            if updater.waits and not updater.is_placed and waited > PLACE_TIMEOUT:
                self._unplaced.remove(updater)
                self._node.get_logger().warning(
                    f'{updater.gateway.model.group}: its position is not known, so the scene of'
                    f' {TOPIC} does not count for it yet; is its bus up, are its joint states'
                    ' published?'
                )

    def _warn_of_others(self) -> None:
        """Name once the joints beside each group of which it is not known where they are."""
        now = self._clock()
        for updater in self._assuming.copy():
            if updater.is_placed and now - self._placed.setdefault(updater, now) > OTHERS_TIMEOUT:
                self._assuming.remove(updater)
                if assumption := updater.gateway.model.assumption(self._joints.places):
                    self._node.get_logger().warning(assumption)
