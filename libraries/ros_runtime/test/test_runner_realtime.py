# SPDX-FileCopyrightText: 2026 The arm and quad developers
# SPDX-License-Identifier: Apache-2.0
"""What becomes of real-time priority and locked memory is logged, in any combination."""

from __future__ import annotations

from isolation import Isolation
import pytest
from rclpy.context import Context
from rclpy.node import Node

from node_runner import raise_thread_priority, settle_process_memory, shared_parameters
from realtime_loop import Outcome


@pytest.mark.parametrize('priority', [True, False])
@pytest.mark.parametrize('memory', [True, False])
def test_each_combination_is_logged(
    priority: bool,
    memory: bool,
    isolation: Isolation,
    monkeypatch: pytest.MonkeyPatch,
    capfd: pytest.CaptureFixture[str],
) -> None:
    """In one node and one after the other; rclpy refuses a line that changes its severity."""
    monkeypatch.setattr(
        shared_parameters, 'raise_priority', lambda *_: Outcome(priority, f'priority {priority}')
    )
    monkeypatch.setattr(shared_parameters, 'settle_memory', lambda: Outcome(memory, f'memory {memory}'))
    context = Context()
    context.init(domain_id=isolation.domain_id)
    node = Node('cycle', context=context)
    settle_process_memory(node)
    raise_thread_priority(node, 80, 'the cycle')
    settle_process_memory(node)
    node.destroy_node()  # type: ignore[no-untyped-call]
    context.shutdown()
    level = 'INFO' if priority else 'WARN'
    written = capfd.readouterr().err
    assert written.count(f'memory {memory}') == 2
    assert any(level in line for line in written.splitlines() if 'priority' in line)
