# SPDX-FileCopyrightText: 2026 The arm and quad developers
# SPDX-License-Identifier: Apache-2.0
"""Joins the ROS graph before a command is parsed, and before most of rclpy is loaded.

Discovery takes a tenth of a second and more, in threads of DDS: what Python loads meanwhile costs
no time. The participant is there with its first node, which goes when the session has its own.
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
    """Join for a command that will; leave at the end of the block unless a session did join.

    Only where env.sh keeps DDS to this host: to find out what else is wanted takes its time.
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
    """Make context and node by the extension of rclpy alone, whose package takes twice as long."""
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
    """Let rclpy.init take the context that has joined, if one has.

    Yields:
        What ends the node by which it joined, when there is another one.
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
