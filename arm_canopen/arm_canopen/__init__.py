# SPDX-FileCopyrightText: 2026 The arm and quad developers
# SPDX-License-Identifier: Apache-2.0
"""CANopen master and CiA 402 drives for ROS 2.

The names here are the public API. Those that need ROS are loaded when they are asked for, so that
the core can be used without it. Public besides, for tools and simulated devices: the modules of
`standard`, `config` and `can`, `exceptions`, and what `master` names.
"""

from __future__ import annotations

from typing import Any, TYPE_CHECKING

from .can import open_bus
from .cia402.motion import AxisFeedback, MotionSource, Setpoint
from .cia402.refusal import Refusal, RefusalCause
from .config import load_bus
from .config.model import BusConfig, NodeConfig
from .exceptions import CanopenError

if TYPE_CHECKING:
    from .nodes.master import run_master
    from .nodes.master_process import MasterProcess

__all__ = [
    'AxisFeedback',
    'BusConfig',
    'CanopenError',
    'MasterProcess',
    'MotionSource',
    'NodeConfig',
    'Refusal',
    'RefusalCause',
    'Setpoint',
    'load_bus',
    'open_bus',
    'run_master',
]


def __getattr__(name: str) -> Any:  # noqa: ANN401
    if name == 'run_master':
        from .nodes.master import run_master

        return run_master
    if name == 'MasterProcess':
        from .nodes.master_process import MasterProcess

        return MasterProcess
    raise AttributeError(f'module {__name__!r} has no attribute {name!r}')
