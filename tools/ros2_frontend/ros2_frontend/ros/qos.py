# SPDX-FileCopyrightText: 2026 The arm and quad developers
# SPDX-License-Identifier: Apache-2.0
"""QoS options of `topic echo`, `hz`, `pub`, and a profile that matches the publishers."""

from __future__ import annotations

from argparse import Namespace
from collections.abc import Callable
from functools import partial
from typing import Any

from ..cli.commands import positive_float, unsigned_int
from ..names import Handle
from .graph import Graph

_POLICIES = ('history', 'reliability', 'durability', 'liveliness')
_FALL_BACK = (
    'Some, but not all, publishers are offering QoS{0}Policy.{1}. Falling back to '
    'QoS{0}Policy.{2} as it will connect to all publishers'
)


def _policy(name: str) -> Handle:
    from rclpy import qos

    return getattr(qos, f'QoS{name.capitalize()}Policy')


def _preset(key: str) -> Handle:
    """Return a copy of a preset, which the whole process shares."""
    from rclpy.qos import QoSPresetProfiles, QoSProfile

    preset = QoSPresetProfiles.get_from_short_key(key)
    names = [name.lstrip('_') for name in QoSProfile.__slots__]
    return QoSProfile(**{name: getattr(preset, name) for name in names})


def add_qos_arguments(parser: Any, verb: str, preset: str) -> None:  # noqa: ANN401  # argparse's
    """Add the QoS options of a verb; `verb` is `subscribe` or `publish`, for the help."""
    from rclpy.qos import QoSPresetProfiles

    default = _preset(preset)

    def help_(what: str, value: str, default_: object) -> str:
        return (
            f'{what} setting to {verb} with '
            f'(overrides {value} value of --qos-profile option, default: {default_})'
        )

    parser.add_argument(
        '--qos-profile',
        choices=QoSPresetProfiles.short_keys(),
        default=preset,
        help=f'Quality of service preset profile to {verb} with (default: {preset})',
    )
    parser.add_argument(
        '--qos-depth',
        metavar='N',
        type=unsigned_int,
        help=help_('Queue size', 'depth', default.depth),
    )
    for name in _POLICIES:
        parser.add_argument(
            f'--qos-{name}',
            choices=_policy(name).short_keys(),
            help=help_(f'Quality of service {name}', name, getattr(default, name).short_key),
        )
    parser.add_argument(
        '--qos-liveliness-lease-duration-seconds',
        type=positive_float,
        help=help_(
            'Quality of service liveliness lease duration',
            'liveliness lease duration',
            default.liveliness_lease_duration,
        ),
    )


SUBSCRIPTION_QOS = partial(add_qos_arguments, verb='subscribe', preset='sensor_data')
PUBLISHER_QOS = partial(add_qos_arguments, verb='publish', preset='default')


def profile_of(args: Namespace) -> Handle:
    """Return the preset with the overrides of the parsed options."""
    from rclpy.duration import Duration

    profile = _preset(args.qos_profile)
    for name in _POLICIES:
        if (chosen := getattr(args, f'qos_{name}')) is not None:
            setattr(profile, name, _policy(name).get_from_short_key(chosen))
    if args.qos_liveliness_lease_duration_seconds is not None:
        seconds = args.qos_liveliness_lease_duration_seconds
        profile.liveliness_lease_duration = Duration(seconds=seconds)
    if args.qos_depth is not None:
        profile.depth = args.qos_depth
    elif profile.durability.short_key == 'transient_local' and profile.depth == 0:
        profile.depth = 1
    return profile


def matching_profile(
    args: Namespace, graph: Graph, topic: str, report: Callable[[str], None]
) -> Handle:
    """Return a profile that matches all publishers of a topic, unless the options name one.

    Reliable if all publishers are, transient local if all are; else one that matches all, which is
    reported.
    """
    profile = profile_of(args)
    publishers = [info.qos_profile for info in graph.publishers(topic)]
    overridden = any(
        value is not None
        for name, value in vars(args).items()
        if name.startswith('qos_') and name != 'qos_profile'
    )
    if not publishers or overridden:
        return profile
    for name, strong, weak in (
        ('reliability', 'RELIABLE', 'BEST_EFFORT'),
        ('durability', 'TRANSIENT_LOCAL', 'VOLATILE'),
    ):
        offered = [getattr(publisher, name).name == strong for publisher in publishers]
        if any(offered) and not all(offered):
            report(_FALL_BACK.format(name.capitalize(), strong, weak))
        setattr(profile, name, _policy(name)[strong if all(offered) else weak])
    return profile
