# SPDX-FileCopyrightText: 2026 The arm and quad developers
# SPDX-License-Identifier: Apache-2.0
"""Functions shared by arms and quadrupeds: pure, without ROS, threads or clocks."""

from __future__ import annotations

from .c_library import cache_folder, load_c_library
from .joint_states import JointSample, JointStateStore
from .settings import setting, settings_of, settings_problem, switch
from .stream_gate import StreamGate, StreamRules

__all__ = [
    'JointSample',
    'JointStateStore',
    'StreamGate',
    'StreamRules',
    'cache_folder',
    'load_c_library',
    'setting',
    'settings_of',
    'settings_problem',
    'switch',
]
