# SPDX-FileCopyrightText: 2026 The arm and quad developers
# SPDX-License-Identifier: Apache-2.0
"""Where any thread gives commands to the motion core, and reads what it does.

Every motion goes the same way: it is requested in any thread, prepared beside the cycle from the
state that the cycle hands out, and committed in the cycle. A stop counts from the moment of the
call: whatever was requested before it is refused at every later step, so no stop is overtaken by
what was under way.
"""

from __future__ import annotations

from collections.abc import Callable
from concurrent.futures import Executor, Future, ThreadPoolExecutor
import time

from arm_model import ArmError, Array, PlanningScene, RobotModel, RobotState
from arm_trajectory import GoalCode

from ..exceptions import NotReadyError
from .hold_to_run import BEGINS, HoldToRun
from .motion_core import MotionCore
from .motion_queue import MotionCommand, MotionQueue
from .moving_arms import Neighbours
from .orders import CommandOrder, Cycle, OrderQueue
from .requests import ImmediateRequest, JogRequest, MotionRequest, PauseRequest, StopRequest
from .scene_exchange import SceneExchange
from .set_point import JOGGING, MOTIONS, SetPoint, Source
from .snapshot import Snapshot
from .trajectory_stream import TrajectoryStream

MAX_QUEUED_JOGS = 1000  # jog commands that may wait for the cycle


def start_worker() -> Executor:
    """Start the thread that prepares motions; the cycle hands over to it, and starts none."""
    worker = ThreadPoolExecutor(1, thread_name_prefix='motion preparation')
    worker.submit(lambda: None)  # an executor starts its thread with the first piece of work
    return worker


class CommandGateway:
    """Commands to one motion core from any thread, carried out by the thread that steps it.

    The commands and :attr:`snapshot`, :attr:`model` are for any thread; :meth:`begin`,
    :meth:`step`, :meth:`fail` and :meth:`idle` for the cycle. The kinematics of the core's model
    belong to the cycle too. Times are steady times in [s].

    Attributes:
        holds: Which clients hold a jog, and have to let go after the arm had stopped following.
        stream: What comes on the topic of trajectories, and ends in the same way.
    """

    def __init__(
        self, core: MotionCore, worker: Executor, clock: Callable[[], float] = time.monotonic
    ) -> None:
        """Wait for the arm.

        Args:
            core: The core; from here on it is the gateway's.
            worker: Prepares motions, one after the other; see :func:`start_worker`.
            clock: Steady time, the one of the cycle.
        """
        self.model: RobotModel = core.model
        self._core = core
        self._orders = OrderQueue()
        self._clock = clock
        self._order = CommandOrder()
        self.holds = HoldToRun()
        self.stream = TrajectoryStream(clock)
        self._scenes = SceneExchange(core, self._orders, worker)
        self._motions = MotionQueue(
            core,
            self._orders,
            self._order,
            worker,
            clock,
            rest=self._rest,
            recheck=self._scenes.recheck,
        )
        self._snapshot = Snapshot(0.0, None, None, 'the cycle has not begun yet')

    @property
    def refused(self) -> float:
        """When a motion was refused last, as the arm did not follow, in [s]."""
        return self._order.refused

    @property
    def snapshot(self) -> Snapshot:
        """What the core did in the last cycle."""
        return self._snapshot

    def command(
        self, request: ImmediateRequest, get_ready: Callable[[], object] = lambda: None
    ) -> Future[None]:
        """Apply a jog, a stop, a pause or a speed override from the next cycle on.

        A stop refuses from the moment of the call what was requested before it, a pause what jogs.

        Args:
            get_ready: Gets back drives that others have; called for a request that is not refused.

        Returns:
            Nothing once it counts; the ArmError with which it was refused.
        """
        future: Future[None] = Future()
        number = self._order.number()  # first: a stop during what follows counts
        try:
            prepared = self._core.prepare(request)
            if isinstance(request, JogRequest) and len(self._orders) >= MAX_QUEUED_JOGS:
                raise NotReadyError(f'{MAX_QUEUED_JOGS} commands wait for the cycle')
            if isinstance(request, JogRequest):
                self.holds.command(
                    request.client,
                    self._clock(),
                    is_zero=request.is_zero,
                    expires=request.expires,
                )
            get_ready()
        except ArmError as error:
            future.set_exception(error)
            return future
        since = self._clock()
        if isinstance(request, StopRequest):
            self._order.void(request.sources or MOTIONS, request.reason)
        elif isinstance(request, PauseRequest) and request.is_paused:
            self._order.void(JOGGING, 'the arm was paused')

        def commit(cycle: Cycle) -> bool:
            try:
                if isinstance(request, JogRequest) and not request.is_zero:
                    self._order.admit(Source.JOG, number, since, cycle)
                self._core.commit(prepared, cycle.now)
            except Exception as error:  # noqa: BLE001  # its future carries it
                future.set_exception(error)
                return True
            if isinstance(request, JogRequest) and not request.is_zero:
                # the newest command counts: older ones never begin
                self._order.void((Source.TARGET, Source.TRAJECTORY), 'a jog took over', number)
            future.set_result(None)
            return True

        self._orders.append(commit)
        return future

    def request(
        self, request: MotionRequest, get_ready: Callable[[], object] = lambda: None
    ) -> MotionCommand:
        """Prepare a motion, and begin it when its path is clear.

        Args:
            get_ready: Gets back drives that others have, where the arm does not follow; called in
                any thread, and only for a motion that is not refused from where the arm stands.
        """
        return self._motions.request(request, get_ready)

    def cancel(self, command: MotionCommand, reason: str) -> None:
        """End a motion: before its begin it does not begin, later the arm comes to rest."""
        self._motions.cancel(command, reason)

    def use_scene(self, scene: PlanningScene) -> Future[int]:
        """Use another scene from the next cycle on, for jogs, targets and trajectories.

        It is measured here, beside the cycle, which takes some milliseconds for 100 objects. A
        trajectory under way is checked again, and ends on its path where it would collide.

        Returns:
            Its version once it counts.

        Raises:
            SceneError: The scene is of another arm.
        """
        reference = self._snapshot.reference
        return self._scenes.use(scene, None if reference is None else reference.position)

    def keep_apart(self, neighbours: Neighbours) -> None:
        """Heed from now on how other arms of the robot move; before the first cycle."""
        self._core.keep_apart(neighbours)

    def begin(self, positions: Array) -> None:
        """Begin to command the arm where it stands.

        Args:
            positions: Positions last commanded to the drives in [rad].
        """
        self._core.reset(positions)
        if self.stream.begin():
            self._order.void((Source.TRAJECTORY,), BEGINS)
        if self.holds.begin(self._clock()):
            self._order.void((Source.JOG,), BEGINS)

    def reset(self, positions: Array) -> None:
        """Go on from where others have moved the arm while it was at rest."""
        self._core.reset(positions)

    def step(
        self,
        now: float,
        period: float,
        measured: RobotState,
        blocked: str,
        ages: Array | None = None,
    ) -> SetPoint:
        """Carry out what was commanded, and return the set-point of this cycle.

        Args:
            blocked: Why the arm comes to rest and takes no commands; empty when it does.
            ages: How old the measured values of each joint are in [s].
        """
        self._orders.carry_out(Cycle(now, period, blocked))
        set_point = self._core.step(now, period, measured)
        self._motions.report_ends()
        self._snapshot = Snapshot(
            now,
            set_point,
            measured,
            blocked,
            set_point.source,
            self._core.paused,
            self._core.speed,
            self._snapshot.cycles + 1,
            period,
            self._core.execution,
            ages,
        )
        return set_point

    def refuse_earlier(self, reason: str) -> None:
        """Refuse what was requested so far and has not begun; for any thread."""
        self._interrupt(reason)

    def fail(self, reason: str, code: GoalCode = GoalCode.INVALID_GOAL) -> None:
        """Bring the arm to rest, a trajectory on its path; the motion ends with the reason."""
        self._interrupt(reason)
        self._core.fail(reason, code)

    def idle(
        self, now: float, measured: RobotState | None, blocked: str, ages: Array | None = None
    ) -> None:
        """Pass a cycle in which the arm does not follow; commands are refused.

        Args:
            ages: How old the measured values of each joint are in [s].
        """
        if self._snapshot.set_point is not None:
            self._interrupt(blocked)
        self._core.stands(measured)
        self._core.abandon(blocked)  # it ended at the latest when the arm came to rest
        self._motions.report_ends()
        self._orders.carry_out(Cycle(now, self._snapshot.period, blocked))
        self._snapshot = Snapshot(
            now,
            None,
            measured,
            blocked,
            paused=self._core.paused,
            speed=self._core.speed,
            cycles=self._snapshot.cycles,
            ages=ages,
        )

    def abandon(self, now: float, reason: str) -> None:
        """End all that was commanded, for a cycle that has failed: none may follow."""
        self._interrupt(reason)
        self._motions.clear(reason)
        self.idle(now, self._snapshot.measured, reason)

    def _interrupt(self, reason: str) -> None:
        self._order.void(MOTIONS, reason)
        self.holds.interrupt(reason, self._clock())
        self.stream.interrupt(reason)

    def _rest(self) -> RobotState | None:
        """Return where the arm stands while others have its drives; None where it follows."""
        snapshot = self._snapshot
        return snapshot.reference if snapshot.blocked else None
