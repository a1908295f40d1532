# SPDX-FileCopyrightText: 2026 The arm and quad developers
# SPDX-License-Identifier: Apache-2.0
"""Updates the planning scene and the positions of other joints for the groups moved here.

Another arm, which moves independently, is checked at its last rest position; while it moves,
:class:`MovingArms` keeps the two apart. Other joints outside the group (a gripper, a neck, a lift)
are checked at their measured positions, up to half a second old.
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
"""Computes a new scene from the previous one and the group's joint positions in [rad]."""

MOVING_PERIOD = 0.5  # time between scene updates for a moving joint outside the group in [s]

PLACE_TOLERANCE = 1e-3
"""Greatest apparent motion of a joint at rest in [rad] or [m], from sensor noise."""


@dataclass(frozen=True, slots=True)
class JointPlaces:
    """Snapshot of the joint positions of a robot."""

    # positions in [rad] or [m], by joint
    places: Mapping[str, float] = field(default_factory=dict)
    moving: Collection[str] = frozenset()  # joints that move

    def next(self, places: Mapping[str, float], commanded: Collection[str]) -> JointPlaces:
        """Return the next snapshot; a joint without an earlier position counts as moving."""
        moved = {
            joint
            for joint, place in places.items()
            if not abs(place - self.places.get(joint, math.nan)) <= PLACE_TOLERANCE
        }
        return JointPlaces(places, moved.union(commanded))


class SceneUpdater:
    """Applies the newest scene to one group, with the joints outside the group where they are.

    Call :meth:`change` in one thread and :meth:`update`, which may take long, in another.
    """

    def __init__(
        self,
        gateway: CommandGateway,
        arms: Mapping[str, Sequence[str]],  # joints of independently moving arms, by group
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
        self._changes: deque[SceneChange] = deque()  # the last whole scene, and later diffs

    @property
    def waits(self) -> bool:
        """Whether a scene change is pending."""
        return bool(self._changes)

    @property
    def others(self) -> Mapping[str, float]:
        """Positions in [rad] used for the joints outside the group, by joint."""
        return self._planned.kinematics.others

    @property
    def is_placed(self) -> bool:
        """Whether the position of the group is known, so that a scene can be applied."""
        return self.gateway.snapshot.reference is not None

    def change(self, change: SceneChange, *, is_whole: bool) -> None:
        """Queue a scene change; a whole scene replaces the queued changes."""
        if is_whole:
            self._changes = deque([change])
        else:
            self._changes.append(change)

    def update(self, joints: JointPlaces, now: float) -> None:
        """Apply the next change and new joint positions, if the group's position is known.

        An equal scene has no effect.

        Raises:
            ArmError: The scene is refused; the previous one stays in use.
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
        """Return the pairs of links that the given groups move."""
        return frozenset().union(*(self._moved_by_others[group] for group in groups))

    def _elsewhere(self, joints: JointPlaces, now: float) -> Mapping[str, float]:
        """Return new positions of joints outside the group that differ from those in use."""
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
"""Topic on which arm_planning's move_group publishes the collision scene, latched, after each
change; meshes come as precomputed hulls, for programs with a control cycle."""

FOREIGN_TOPIC = 'monitored_planning_scene'
"""Scene topic of any move_group; used if nothing publishes the other topic."""

FOREIGN_DEPTH = 100  # messages of MoveIt's monitor that may wait, as it keeps as many

ASK_AFTER = 1.0  # time from the start in [s] in which a whole scene may come by itself

LOOK_PERIOD = 0.1  # period of reading the joint positions in [s]
ANSWER_TIMEOUT = 5.0
"""Time in [s] to wait for a requested whole scene before it is requested again."""

PLACE_TIMEOUT = 1.0  # time for which a scene waits for a group's position without a warning in [s]
OTHERS_TIMEOUT = 5.0  # time to wait for joints outside a group without a warning in [s]


class SceneListener:
    """Applies scenes, scene diffs and the positions of other joints to all groups.

    A separate thread builds and measures scenes, so neither the executor nor a cycle waits. A
    repeated refusal is logged once.
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
        """Subscribe to scenes, and to joint states if there are joints outside the groups."""
        self._node, self._clock = node, clock
        self._worker = worker or ThreadPoolExecutor(1, thread_name_prefix='scenes')
        arms = {gateway.model.group: gateway.model.joints for gateway in gateways}
        free = [gateway for gateway in gateways if gateway.model.moved_by_others]
        moving = MovingArms([gateway.model for gateway in free]) if free else None
        if moving is not None:  # independently moving arms share their stops
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
        self._unplaced = list(self._updaters)  # no warning logged yet
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
        """Handle a volatile scene message, if no latched topic provides it."""
        publishers = self._node.get_publishers_info_by_topic(FOREIGN_TOPIC)
        if all(each.qos_profile.durability != LATCHED.durability for each in publishers):
            self._take_foreign(data)

    def _take_foreign(self, data: bytes) -> None:
        if not self._node.count_publishers(TOPIC):
            self._take(deserialize_message(data, PlanningScene))

    def _ask(self) -> None:
        """Request the whole scene of a move_group that started earlier, until it arrives."""
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
        """Apply a message to a scene; runs in the scene thread."""
        try:
            return apply_planning_scene(scene, message, positions, world_frames=model.world_frames)
        except Exception:
            if not message.is_diff:
                self._is_complete = False  # it is requested again
            raise

    def _take_joints(self, message: JointState) -> None:
        self._states.receive(message.name, message.position, [], self._clock())

    def _look(self) -> None:
        """Read the joint positions, and submit updates to the scene thread."""
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
        """Apply pending updates to a group; runs in the scene thread."""
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
        """Warn that objects may be missing from the scene."""
        if not self._is_complete and self._clock() - self._missed > ANSWER_TIMEOUT:
            self._node.get_logger().warning(
                f'{FOREIGN_TOPIC}: no whole scene came in {ANSWER_TIMEOUT:g} s: only what diffs'
                ' (is_diff) name counts, and objects that were there before them do not; start'
                ' this node before move_group, or have move_group answer get_planning_scene or'
                ' publish a whole scene',
                once=True,
            )

    def _warn_of_groups(self) -> None:
        """Warn once for each group whose scene waits because its position is unknown."""
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
        """Warn once of the joints outside each group whose positions are unknown."""
        now = self._clock()
        for updater in self._assuming.copy():
            if updater.is_placed and now - self._placed.setdefault(updater, now) > OTHERS_TIMEOUT:
                self._assuming.remove(updater)
                if assumption := updater.gateway.model.assumption(self._joints.places):
                    self._node.get_logger().warning(assumption)
