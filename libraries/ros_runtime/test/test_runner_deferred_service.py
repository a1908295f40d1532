# SPDX-FileCopyrightText: 2026 The arm and quad developers
# SPDX-License-Identifier: Apache-2.0
"""Services whose responses are sent later."""

from __future__ import annotations

from collections.abc import Callable
from concurrent.futures import Future, ThreadPoolExecutor
import threading
from typing import Any

from isolation import Isolation
import pytest
from ros_client import RosClient
from std_srvs.srv import Trigger

from node_runner import create_deferred_service

TIMEOUT = 20.0  # [s]


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
