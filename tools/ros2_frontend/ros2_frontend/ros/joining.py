# SPDX-FileCopyrightText: 2026 The arm and quad developers
# SPDX-License-Identifier: Apache-2.0
"""Joins the ROS graph before the command is parsed and most of rclpy is loaded.

Discovery takes 0.1 s or more in threads of DDS, so Python's imports meanwhile cost no time. The
participant exists with its first node, which is removed when the session has its own.
"""

from __future__ import annotations

from collections.abc import Callable, Iterator, Sequence
import contextlib
from importlib.machinery import PathFinder
from importlib.util import find_spec, module_from_spec
import os
import sys
from typing import TYPE_CHECKING

from .. import LIBRARIES

if TYPE_CHECKING:
    from ..names import Handle

NODE_PREFIX = '_ros2cli'  # a leading underscore hides a node from `ros2 node list`
ARGUMENTS = ('--ros-args', '--disable-external-lib-logs')  # no log file per command
_JOINING = frozenset({'action', 'lifecycle', 'node', 'param', 'service', 'topic'})
_HELP = frozenset({'-h', '--help'})
_EXTENSION = 'rclpy._rclpy_pybind11'
_PROFILE = f'{LIBRARIES}/ros_runtime/dds_network/dds_network_localhost.xml'
_SET_BY_ENV_SH = {
    'FASTRTPS_DEFAULT_PROFILES_FILE': _PROFILE,
    'ROS_AUTOMATIC_DISCOVERY_RANGE': 'SYSTEM_DEFAULT',
}

_joined: list[tuple[Handle, Handle]] = []  # context and node, until a session takes them


@contextlib.contextmanager
def joined_early(words: Sequence[str]) -> Iterator[None]:
    """Join for a command that will need it; leave after the block unless a session took over.

    Only if env.sh restricts DDS to this host: to determine another reach takes time.
    """
    group, *verb = [word for word in words if not word.startswith('-')] or ['']
    if (
        (group in _JOINING and verb and not _HELP.intersection(words))
        and _SET_BY_ENV_SH.items() <= os.environ.items()
        and not os.environ.get('DDS_NETWORK')
        and os.environ.get('ROS_LOCALHOST_ONLY') != '1'
        and 'rclpy' not in sys.modules
    ):
        _joined.append(_join())
    try:
        yield
    finally:
        for context, node in _joined:
            node.destroy_when_not_in_use()
            context.shutdown()
        _joined.clear()


def _join() -> tuple[Handle, Handle]:
    """Create context and node by rclpy's extension alone, in half the time of the package."""
    package = find_spec('rclpy')
    folders = package.submodule_search_locations if package else None
    spec = PathFinder.find_spec(_EXTENSION, folders)
    if spec is None or spec.loader is None:
        raise ModuleNotFoundError(_EXTENSION)
    extension: Handle = module_from_spec(spec)
    spec.loader.exec_module(extension)
    sys.modules[_EXTENSION] = extension
    context = extension.Context(list(ARGUMENTS), extension.RCL_DEFAULT_DOMAIN_ID)
    name = f'{NODE_PREFIX}_{os.getpid()}_joining'
    return context, extension.Node(name, '', context, None, False, False)


@contextlib.contextmanager
def early_context(extension: Handle) -> Iterator[Callable[[], None]]:
    """Make rclpy.init reuse the context that has already joined, if there is one.

    Yields:
        A function that destroys the node that joined, once there is another.
    """
    if not _joined:
        yield lambda: None
        return
    context, node = _joined.pop()
    make = extension.Context
    extension.Context = lambda *_: context
    try:
        yield node.destroy_when_not_in_use
    finally:
        extension.Context = make
