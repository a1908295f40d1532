# SPDX-FileCopyrightText: 2026 The arm and quad developers
# SPDX-License-Identifier: Apache-2.0
"""Goals and requests that end later, so that no callback waits."""

from __future__ import annotations

from collections.abc import Callable
from concurrent.futures import Future, ThreadPoolExecutor
import threading
import time
from typing import Any

from action_msgs.msg import GoalStatus
from action_msgs.srv import CancelGoal
from isolation import Isolation
import pytest
import rclpy
from rclpy.executors import SingleThreadedExecutor
from rclpy.node import Node
from ros_client import RosClient
from std_srvs.srv import Trigger
from tf2_msgs.action import LookupTransform
from tf2_msgs.msg import TF2Error

from node_runner import action_goals, create_deferred_service
from node_runner.action_goals import Ending, GoalServer, ServedGoal

TIMEOUT = 20.0  # [s]


def serve(
    node: Node,
    start: Callable[[ServedGoal], None],
    ending: Ending | None = Ending.SUCCEEDED,
    accept: Callable[[], ServedGoal] = ServedGoal,
    has_stopped: Callable[[ServedGoal], bool] | None = None,
) -> GoalServer[ServedGoal]:
    """Serve goals of an action; without an ending all callbacks raise.

    A cancel ends a goal, but where ``has_stopped`` says when.
    """

    def cancel(goal: ServedGoal) -> None:
        if has_stopped is None:
            server.end(goal)
        if ending is None:
            raise RuntimeError('no cancel')

    def conclude(_: ServedGoal) -> tuple[Ending, LookupTransform.Result]:
        if ending is None:
            raise RuntimeError('no end')
        return ending, LookupTransform.Result()

    def fail(_: ServedGoal, error: Exception) -> LookupTransform.Result:
        return LookupTransform.Result(error=TF2Error(error=9, error_string=str(error)))

    server = GoalServer(
        node,
        LookupTransform,
        'look_up',
        accept=accept,
        start=start,
        cancel=cancel,
        conclude=conclude,
        fail=fail,
        refusals=(ValueError,),
        has_stopped=has_stopped or (lambda _: True),
    )
    return server


def send(client: RosClient) -> Any:
    """Send a goal once its server is there; return the future of its acceptance."""
    caller = client.action(LookupTransform, 'look_up')
    assert caller.wait_for_server(TIMEOUT)  # type: ignore[no-untyped-call]
    return caller.send_goal_async(LookupTransform.Goal())  # type: ignore[no-untyped-call]


def begin(client: RosClient, begun: list[ServedGoal]) -> Any:
    """Send a goal; return its handle when it has been accepted and has begun."""
    sent = send(client)
    client.spin_until(lambda: sent.done() and bool(begun), TIMEOUT, 'acceptance')
    return sent.result()


def result_of(client: RosClient, goal: Any) -> Any:
    """Return status and result of a goal when it has ended."""
    result = goal.get_result_async()
    client.spin_until(result.done, TIMEOUT, 'a result')
    return result.result()


@pytest.mark.slow
def test_a_goal_goes_on_after_its_callback_and_is_forgotten_after_its_end(
    isolation: Isolation, monkeypatch: pytest.MonkeyPatch
) -> None:
    """Rclpy would keep each for 15 minutes: a busy server grew by 5 MB an hour."""
    monkeypatch.setattr(action_goals, 'RESULT_TIMEOUT', 1.0)
    begun: list[ServedGoal] = []

    with RosClient(isolation.domain_id) as client:
        server = serve(client.node, begun.append)
        goal = begin(client, begun)
        assert begun[0].handle.status == GoalStatus.STATUS_EXECUTING
        server.end(begun[0])
        assert result_of(client, goal).status == GoalStatus.STATUS_SUCCEEDED

        def is_forgotten() -> bool:
            return bool(result_of(client, goal).status == GoalStatus.STATUS_UNKNOWN)

        client.spin_until(is_forgotten, TIMEOUT, 'its end')
        server.destroy()


@pytest.mark.slow
def test_a_goal_whose_answers_are_delayed_keeps_its_executor_asleep(isolation: Isolation) -> None:
    """A coroutine that waited for them was resumed 170,000 times a second: a core a goal."""
    begun: list[ServedGoal] = []
    with RosClient(isolation.domain_id) as client:
        server = serve(client.node, begun.append)
        passes = 0

        def passed(done: Callable[[], bool]) -> bool:
            nonlocal passes
            passes += 1
            return done()

        sent = send(client)
        client.spin_until(lambda: passed(lambda: bool(begun)), TIMEOUT, 'the start')
        end = time.monotonic() + 0.5  # its acceptance is about to be repeated
        client.spin_until(lambda: passed(lambda: time.monotonic() > end), TIMEOUT, 'some time')
        result = sent.result().get_result_async()
        server.end(begun[0])
        client.spin_until(lambda: passed(result.done), TIMEOUT, 'a result')
        assert passes < 1000
        server.destroy()


@pytest.mark.slow
@pytest.mark.parametrize(
    ('ending', 'is_canceled', 'status'),
    [
        (Ending.SUCCEEDED, True, GoalStatus.STATUS_SUCCEEDED),
        (Ending.CANCELED, True, GoalStatus.STATUS_CANCELED),
        (Ending.CANCELED, False, GoalStatus.STATUS_ABORTED),
        (Ending.ABORTED, True, GoalStatus.STATUS_ABORTED),
    ],
)
def test_a_goal_ends_once_with_the_status_of_its_server(
    isolation: Isolation, ending: Ending, is_canceled: bool, status: int
) -> None:
    """It is canceled only where a client has asked for that."""
    begun: list[ServedGoal] = []
    with RosClient(isolation.domain_id) as client:
        server = serve(client.node, begun.append, ending)
        goal = begin(client, begun)
        assert server.running == begun
        if is_canceled:
            goal.cancel_goal_async()
        else:
            server.end(begun[0])
            server.end(begun[0])
        assert result_of(client, goal).status == status
        assert not server.running
        server.destroy()


@pytest.mark.slow
def test_a_goal_that_cannot_say_whether_it_stands_hides_no_other(isolation: Isolation) -> None:
    """Each is looked at, also behind one whose own look, and question for rest, have raised."""
    begun: list[ServedGoal] = []
    looked: list[ServedGoal] = []

    def look(goal: ServedGoal) -> None:
        looked.append(goal)
        raise ValueError('lost')

    def has_stopped(_: ServedGoal) -> bool:
        raise RuntimeError('no measurement')

    with RosClient(isolation.domain_id) as client:
        server = serve(client.node, begun.append, has_stopped=has_stopped)
        caller = client.action(LookupTransform, 'look_up')
        assert caller.wait_for_server(TIMEOUT)  # type: ignore[no-untyped-call]
        for _ in range(2):
            caller.send_goal_async(LookupTransform.Goal())  # type: ignore[no-untyped-call]
        client.spin_until(lambda: len(begun) == 2, TIMEOUT, 'the start')
        server.watch(look)
        assert looked == begun
        assert all(goal.has_ended for goal in begun)  # neither stays without an answer
        server.destroy()


@pytest.mark.slow
def test_a_cancel_of_all_goals_counts_for_one_that_is_not_accepted_yet(
    isolation: Isolation, monkeypatch: pytest.MonkeyPatch
) -> None:
    """The acceptance is delayed for the client; the goal would begin after the cancel."""
    monkeypatch.setattr(action_goals, 'ANSWER_DELAY', 1.0)
    received: list[ServedGoal] = []

    def accept() -> ServedGoal:
        received.append(ServedGoal())
        return received[-1]

    with RosClient(isolation.domain_id) as client:
        server = serve(client.node, lambda _: None, Ending.CANCELED, accept)
        sent = send(client)
        client.spin_until(lambda: bool(received), TIMEOUT, 'the request')
        cancel = client.call_async(CancelGoal, 'look_up/_action/cancel_goal', CancelGoal.Request())
        client.spin_until(cancel.done, TIMEOUT, 'the answer to the cancel')
        assert not sent.done()
        client.spin_until(sent.done, TIMEOUT, 'acceptance')
        assert result_of(client, sent.result()).status == GoalStatus.STATUS_CANCELED
        server.destroy()


@pytest.mark.slow
@pytest.mark.parametrize(
    ('wrong', 'reason', 'is_logged'),
    [
        (ValueError('no such frame'), 'no such frame', False),
        (RuntimeError('no start'), 'no start', True),
        (None, 'no end', True),
    ],
    ids=['refused', 'at the start', 'at the end'],
)
def test_a_goal_that_fails_is_aborted_with_the_reason(
    isolation: Isolation,
    capfd: pytest.CaptureFixture[str],
    wrong: Exception | None,
    reason: str,
    is_logged: bool,
) -> None:
    """No callback ends the executor, and no result says 0, which is success."""
    begun: list[ServedGoal] = []

    def start(goal: ServedGoal) -> None:
        begun.append(goal)
        if wrong is not None:
            raise wrong

    with RosClient(isolation.domain_id) as client:
        server = serve(client.node, start, None)
        goal = begin(client, begun)
        if wrong is None:
            cancel = goal.cancel_goal_async()
            client.spin_until(cancel.done, TIMEOUT, 'an answer')
            assert not cancel.result().goals_canceling
        answer = result_of(client, goal)
        assert answer.status == GoalStatus.STATUS_ABORTED
        assert answer.result.error == TF2Error(error=9, error_string=reason)
        assert not server.running
        server.destroy()
    assert ('Traceback' in capfd.readouterr().err) == is_logged


@pytest.mark.slow
def test_a_goal_is_answered_by_an_executor_that_heeds_groups(isolation: Isolation) -> None:
    """As that of ROS where there is no events executor."""
    with RosClient(isolation.domain_id) as client:
        context = client.node.context
        node = rclpy.create_node('server', context=context)
        executor = SingleThreadedExecutor(context=context)
        executor.add_node(node)
        server = serve(node, lambda _: None)
        sent = send(client)

        def answered() -> bool:
            executor.spin_once(0.01)
            return bool(sent.done())

        client.spin_until(answered, TIMEOUT, 'acceptance')
        assert sent.result().accepted
        server.destroy()
        executor.shutdown()
        node.destroy_node()  # type: ignore[no-untyped-call]


class _SlowClient:
    """The handle of a client whose thread pauses [s] after it has sent a request."""

    def __init__(self, handle: Any, pause: float) -> None:
        self._handle = handle
        self._pause = pause

    def __getattr__(self, name: str) -> Any:
        return getattr(self._handle, name)

    def send_goal_request(self, request: Any) -> Any:
        number = self._handle.send_goal_request(request)
        time.sleep(self._pause)
        return number

    def send_result_request(self, request: Any) -> Any:
        number = self._handle.send_result_request(request)
        time.sleep(self._pause)
        return number


@pytest.mark.slow
@pytest.mark.parametrize(('pause', 'goals'), [(0.003, 10), (0.06, 2)], ids=['quiet', 'busy'])
def test_no_answer_is_lost_that_a_client_expects_too_late(
    isolation: Isolation, pause: float, goals: int
) -> None:
    """Rclpy drops an answer that one thread gets before another has noted the request."""

    def start(goal: ServedGoal) -> None:
        server.end(goal)

    with RosClient(isolation.domain_id) as serving, RosClient(isolation.domain_id) as client:
        server = serve(serving.node, start)
        caller = client.action(LookupTransform, 'look_up')
        caller._client_handle = _SlowClient(caller._client_handle, pause)
        ended = threading.Event()
        with ThreadPoolExecutor(2) as threads:
            for each in (serving, client):
                threads.submit(each.spin_until, ended.is_set, 60.0, 'the end')
            try:
                assert caller.wait_for_server(TIMEOUT)  # type: ignore[no-untyped-call]
                for _ in range(goals):
                    goal = caller.send_goal_async(LookupTransform.Goal())  # type: ignore[no-untyped-call]
                    assert eventually(goal.done)
                    assert eventually(goal.result().get_result_async().done)
            finally:
                ended.set()
        server.destroy()


def eventually(condition: Callable[[], bool]) -> bool:
    """Wait until something is so."""
    end = time.monotonic() + TIMEOUT
    while not condition() and time.monotonic() < end:
        time.sleep(0.001)
    return condition()


@pytest.mark.slow
def test_an_answer_that_takes_time_keeps_nobody_waiting(isolation: Isolation) -> None:
    """The executor serves others meanwhile; no defect leaves a client without an answer."""
    released, begun = threading.Event(), threading.Event()

    def work() -> Trigger.Response:
        begun.set()
        released.wait(TIMEOUT)
        return Trigger.Response(success=True, message=threading.current_thread().name)

    def broken(_: Any) -> Future[Any]:
        raise RuntimeError('broken on purpose')

    def in_words(response: Any, outcome: Future[Any]) -> Any:
        response.message = f'{outcome.exception()} in {threading.current_thread().name}'
        return response

    def half(response: Any, outcome: Future[Any]) -> Any:
        response.message = 'as far as it got'
        response.message = outcome.result().message
        return response

    with (
        RosClient(isolation.domain_id) as client,
        ThreadPoolExecutor(1, 'worker') as pool,
        ThreadPoolExecutor(1, 'answers') as answers,
    ):

        def post(work: Callable[[], None]) -> None:
            answers.submit(work)

        node = client.node
        create_deferred_service(node, Trigger, 'slow', lambda _: pool.submit(work))
        create_deferred_service(node, Trigger, 'refused', broken, in_words, post=post)
        create_deferred_service(node, Trigger, 'broken', broken, half)
        client.node.create_service(Trigger, 'quick', lambda _, response: response)
        waiting = client.call_async(Trigger, 'slow', Trigger.Request())
        client.spin_until(begun.is_set, TIMEOUT, 'the work')
        assert not client.trigger('quick').success
        assert not waiting.done()
        released.set()
        client.spin_until(waiting.done, TIMEOUT, 'the answer')
        assert waiting.result().message.startswith('worker')
        assert client.trigger('refused').message.startswith('broken on purpose in answers')
        answer = client.trigger('broken')
        assert not answer.success
        assert answer.message == 'as far as it got'
