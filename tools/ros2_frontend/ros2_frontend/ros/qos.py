# SPDX-FileCopyrightText: 2026 The arm and quad developers
# SPDX-License-Identifier: Apache-2.0
"""QoS options of `topic echo`, `hz`, `pub`, and the choice that fits the publishers."""

from __future__ import annotations

from argparse import Namespace
from collections.abc import Callable
from functools import partial

from ..aliases import Handle, QosProfile
from ..cli.arguments import positive_float, unsigned_int
from ..cli.verb import Arguments
from .graph import Graph

_OVERRIDES = (
    'qos_depth',
    'qos_history',
    'qos_reliability',
    'qos_durability',
    'qos_liveliness',
    'qos_liveliness_lease_duration_seconds',
)
_FALL_BACK = (
    'Some, but not all, publishers are offering {0}. Falling back to {1} as it will connect '
    'to all publishers'
)


def add_qos_arguments(parser: Arguments, verb: str, preset: str) -> None:
    """Add the QoS options.

    Args:
        parser: The command's parser.
        verb: `subscribe` or `publish`, for the help texts.
        preset: Short key of the default profile, e.g. `sensor_data`.
    """
    from rclpy import qos

    default: QosProfile = qos.QoSPresetProfiles.get_from_short_key(preset)
    parser.add_argument(
        '--qos-profile',
        choices=qos.QoSPresetProfiles.short_keys(),
        default=preset,
        help=f'Quality of service preset profile to {verb} with (default: {preset})',
    )
    parser.add_argument(
        '--qos-depth',
        metavar='N',
        type=unsigned_int,
        help=_help('Queue size', verb, 'depth', default.depth),
    )
    for name, policy in (
        ('history', qos.QoSHistoryPolicy),
        ('reliability', qos.QoSReliabilityPolicy),
        ('durability', qos.QoSDurabilityPolicy),
        ('liveliness', qos.QoSLivelinessPolicy),
    ):
        parser.add_argument(
            f'--qos-{name}',
            choices=policy.short_keys(),
            help=_help(f'Quality of service {name}', verb, name, getattr(default, name).short_key),
        )
    parser.add_argument(
        '--qos-liveliness-lease-duration-seconds',
        type=positive_float,
        help=_help(
            'Quality of service liveliness lease duration',
            verb,
            'liveliness lease duration',
            default.liveliness_lease_duration,
        ),
    )


SUBSCRIPTION_QOS = partial(add_qos_arguments, verb='subscribe', preset='sensor_data')
PUBLISHER_QOS = partial(add_qos_arguments, verb='publish', preset='default')


def _help(what: str, verb: str, value: str, default: object) -> str:
    return (
        f'{what} setting to {verb} with '
        f'(overrides {value} value of --qos-profile option, default: {default})'
    )


def profile_of(args: Namespace) -> QosProfile:
    """The profile that the options set.

    Args:
        args: Parsed arguments of `add_qos_arguments`.

    Returns:
        The preset with the overrides.
    """
    from rclpy import qos
    from rclpy.duration import Duration

    # a preset is shared by the whole process
    profile = _copy_of(qos.QoSPresetProfiles.get_from_short_key(args.qos_profile))
    for name, policy in (
        ('history', qos.QoSHistoryPolicy),
        ('reliability', qos.QoSReliabilityPolicy),
        ('durability', qos.QoSDurabilityPolicy),
        ('liveliness', qos.QoSLivelinessPolicy),
    ):
        chosen = getattr(args, f'qos_{name}')
        if chosen is not None:
            setattr(profile, name, policy.get_from_short_key(chosen))
    if args.qos_liveliness_lease_duration_seconds is not None:
        seconds = args.qos_liveliness_lease_duration_seconds
        profile.liveliness_lease_duration = Duration(seconds=seconds)
    if args.qos_depth is not None:
        profile.depth = args.qos_depth
    elif profile.durability == qos.QoSDurabilityPolicy.TRANSIENT_LOCAL and profile.depth == 0:
        profile.depth = 1
    return profile


def matching_profile(
    args: Namespace, graph: Graph, topic: str, report: Callable[[str], None]
) -> QosProfile:
    """The profile that connects to all publishers of a topic, unless the options name one.

    Args:
        args: Parsed arguments of `add_qos_arguments`.
        graph: The graph with the publishers.
        topic: The topic's absolute name.
        report: Called with a message when the publishers differ.

    Returns:
        Reliable when all publishers are, transient local when all are; else what connects to all.
    """
    from rclpy.qos import QoSDurabilityPolicy, QoSReliabilityPolicy

    profile = profile_of(args)
    publishers = [info.qos_profile for info in graph.publishers(topic)]
    if not publishers or any(getattr(args, name) is not None for name in _OVERRIDES):
        return profile
    for name, strong, weak in (
        ('reliability', QoSReliabilityPolicy.RELIABLE, QoSReliabilityPolicy.BEST_EFFORT),
        ('durability', QoSDurabilityPolicy.TRANSIENT_LOCAL, QoSDurabilityPolicy.VOLATILE),
    ):
        offered = [getattr(publisher, name) == strong for publisher in publishers]
        if any(offered) and not all(offered):
            report(_FALL_BACK.format(_policy_name(strong), _policy_name(weak)))
        setattr(profile, name, strong if all(offered) else weak)
    return profile


def _policy_name(policy: Handle) -> str:
    return f'QoS{type(policy).__name__}.{policy.name}'


def _copy_of(profile: QosProfile) -> QosProfile:
    from rclpy.qos import QoSProfile

    names = [name.lstrip('_') for name in QoSProfile.__slots__]
    return QoSProfile(**{name: getattr(profile, name) for name in names})
