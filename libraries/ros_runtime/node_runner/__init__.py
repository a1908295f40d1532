# SPDX-FileCopyrightText: 2026 The arm and quad developers
# SPDX-License-Identifier: Apache-2.0
"""Shared by all node programs: start, shutdown, and readable errors for wrong parameters."""

from .deferred_service import create_deferred_service
from .discovery import discover_other_nodes, other_nodes, ServerMatch
from .log_bridge import log_as, RosLogBridge
from .parameter_reader import (
    declare_given,
    give_defaults,
    given_values,
    ParameterError,
    ParameterReader,
    refuse_misspelt,
    refuse_similar,
)
from .program import (
    declare_black_box,
    declare_thread_priority,
    destroyed_if_refused,
    destroyed_when_refused,
    init_ros,
    LINGER,
    log_defects,
    make_executor,
    notify_ready,
    raise_thread_priority,
    run_node,
    run_program,
    settle_process_memory,
    spin,
    spin_beside,
    stop_on_signals,
)
from .qos import LATCHED

__all__ = [
    'LATCHED',
    'LINGER',
    'ParameterError',
    'ParameterReader',
    'RosLogBridge',
    'ServerMatch',
    'create_deferred_service',
    'declare_black_box',
    'declare_given',
    'declare_thread_priority',
    'destroyed_if_refused',
    'destroyed_when_refused',
    'discover_other_nodes',
    'give_defaults',
    'given_values',
    'init_ros',
    'log_as',
    'log_defects',
    'make_executor',
    'notify_ready',
    'other_nodes',
    'raise_thread_priority',
    'refuse_misspelt',
    'refuse_similar',
    'run_node',
    'run_program',
    'settle_process_memory',
    'spin',
    'spin_beside',
    'stop_on_signals',
]
