# SPDX-FileCopyrightText: 2026 The arm and quad developers
# SPDX-License-Identifier: Apache-2.0
"""Services whose answers are made in a thread."""

from __future__ import annotations

from concurrent.futures import ThreadPoolExecutor
import threading
from typing import Any

from isolation import Isolation
import pytest
from ros_client import RosClient
from std_srvs.srv import Trigger

from node_runner import create_background_service

TIMEOUT = 20.0  # [s]


@pytest.mark.slow
def test_an_answer_that_takes_time_keeps_nobody_waiting(isolation: Isolation) -> None:
    """The executor serves others meanwhile; a defect of the work leaves the client no waiting."""
    released, begun = threading.Event(), threading.Event()

    def work(_request: Any, response: Any) -> Any:
        begun.set()
        if not released.wait(TIMEOUT):
            return response
        response.success, response.message = True, threading.current_thread().name
        return response

    def broken(_request: Any, response: Any) -> Any:
        response.message = 'as far as it got'
        raise RuntimeError('broken on purpose')

    with RosClient(isolation.domain_id) as client, ThreadPoolExecutor(1, 'worker') as pool:
        create_background_service(client.node, Trigger, 'slow', work, pool)
        create_background_service(client.node, Trigger, 'broken', broken, pool)
        client.node.create_service(Trigger, 'quick', lambda _, response: response)
        waiting = client.call_async(Trigger, 'slow', Trigger.Request())
        client.spin_until(begun.is_set, TIMEOUT, 'the work')
        assert not client.trigger('quick').success
        assert not waiting.done()
        released.set()
        client.spin_until(waiting.done, TIMEOUT, 'the answer')
        assert waiting.result().message.startswith('worker')
        answer = client.trigger('broken')
        assert not answer.success
        assert answer.message == 'as far as it got'
