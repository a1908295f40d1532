# SPDX-FileCopyrightText: 2026 The arm and quad developers
# SPDX-License-Identifier: Apache-2.0
"""What becomes of real-time priority and locked memory is logged, in any combination."""

from __future__ import annotations

import subprocess
import sys

from isolation import Isolation
import pytest
from rclpy.context import Context
from rclpy.node import Node

from node_runner import program, raise_thread_priority, settle_process_memory
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
        program, 'raise_priority', lambda *_: Outcome(priority, f'priority {priority}')
    )
    monkeypatch.setattr(program, 'settle_memory', lambda: Outcome(memory, f'memory {memory}'))
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


SERVICE_MAX = 70.0  # memory of a service in [kB]; 103 where Fast DDS sets room for samples aside

PROGRAM = """
import ctypes, importlib, sys
from node_runner import init_ros
init_ros()
from rclpy.node import Node
from std_srvs.srv import Trigger

class Figures(ctypes.Structure):  # malloc.h
    names = 'arena ordblks smblks hblks hblkhd usmblks fsmblks uordblks fordblks keepcost'
    _fields_ = [(name, ctypes.c_size_t) for name in names.split()]

def used():
    return mallinfo().uordblks

mallinfo = ctypes.CDLL(None).mallinfo2
mallinfo.restype = Figures
node = Node('measured')
made = [node.create_service(Trigger, '~/first', print)]
begin = used()
made += [node.create_service(Trigger, f'~/service_{number}', print) for number in range(40)]
memory = (used() - begin) / 40 / 1000
generator = 'rosidl_generator_py.generate_py_impl' in sys.modules
importlib.import_module('rosidl_generator_py.generate_py_impl')  # importable where needed
print(memory, generator)
node.destroy_node()
"""


def test_neither_samples_nor_a_code_generator_take_memory_in_advance(isolation: Isolation) -> None:
    """Services take memory for what comes in, and messages need no parser of their files."""
    answer = subprocess.run(
        [sys.executable, '-c', PROGRAM],
        env=isolation.env,
        check=True,
        capture_output=True,
        text=True,
        timeout=60.0,
    ).stdout
    memory, generator = answer.split()
    assert float(memory) < SERVICE_MAX
    assert generator == 'False'
