# SPDX-FileCopyrightText: 2026 The arm and quad developers
# SPDX-License-Identifier: Apache-2.0
"""`list`, `info`, `type` and `find` of nodes, topics and services, against real nodes."""

from __future__ import annotations

import re

from frontend_cli import Ros2
import pytest

pytestmark = [pytest.mark.scenario, pytest.mark.usefixtures('zoo')]

STRING, TRIGGER = 'std_msgs/msg/String', 'std_srvs/srv/Trigger'
STRING_HASH = 'RIHS01_df668c740482bbd48fb39d76a70dfd4bd59db1288021743503259e948f6b1a18'
TOPICS = {
    '/chatter': 'std_msgs/msg/String',
    '/joint_states': 'sensor_msgs/msg/JointState',
    '/latched': 'std_msgs/msg/String',
    '/listener/input': 'std_msgs/msg/String',
    '/listener/stamped': 'sensor_msgs/msg/JointState',
    '/machine/transition_event': 'lifecycle_msgs/msg/TransitionEvent',
    '/mixed': 'std_msgs/msg/String',
    '/parameter_events': 'rcl_interfaces/msg/ParameterEvent',
    '/rosout': 'rcl_interfaces/msg/Log',
}
INFO_OF_WORKER = """\
/factory/worker
  Subscribers:

  Publishers:
    /parameter_events: rcl_interfaces/msg/ParameterEvent
    /rosout: rcl_interfaces/msg/Log
  Service Servers:
    /factory/worker/describe_parameters: rcl_interfaces/srv/DescribeParameters
    /factory/worker/get_parameter_types: rcl_interfaces/srv/GetParameterTypes
    /factory/worker/get_parameters: rcl_interfaces/srv/GetParameters
    /factory/worker/get_type_description: type_description_interfaces/srv/GetTypeDescription
    /factory/worker/list_parameters: rcl_interfaces/srv/ListParameters
    /factory/worker/set_parameters: rcl_interfaces/srv/SetParameters
    /factory/worker/set_parameters_atomically: rcl_interfaces/srv/SetParametersAtomically
  Service Clients:

  Action Servers:

  Action Clients:

"""
ENDPOINT = f"""\
Node name: talker
Node namespace: /
Topic type: std_msgs/msg/String
Topic type hash: {STRING_HASH}
Endpoint type: PUBLISHER
GID: [0-9a-f.]+
QoS profile:
  Reliability: RELIABLE
  History \\(Depth\\): UNKNOWN
  Durability: VOLATILE
  Lifespan: Infinite
  Deadline: Infinite
  Liveliness: AUTOMATIC
  Liveliness lease duration: Infinite
"""


@pytest.mark.parametrize(
    ('words', 'answer'),
    [
        ('node list', '/factory/worker\n/machine\n/talker\n'),  # not the hidden one, nor our own
        ('node list -a -c', '5\n'),
        ('node info /factory/worker', INFO_OF_WORKER),  # an empty block is one empty line
        ('topic list -t', ''.join(f'{name} [{type_}]\n' for name, type_ in TOPICS.items())),
        ('topic --include-hidden-topics list', '\n'.join(['/_hidden_chatter', *TOPICS, ''])),
        ('topic list --include-hidden-topics -c', f'{len(TOPICS) + 1}\n'),
        ('topic info /chatter', f'Type: {STRING}\nPublisher count: 1\nSubscription count: 0\n'),
        ('topic type /joint_states', 'sensor_msgs/msg/JointState\n'),
        ('topic --include-hidden-topics type /_hidden_chatter', f'{STRING}\n'),
        ('topic find sensor_msgs/msg/JointState', '/joint_states\n/listener/stamped\n'),
        ('topic find rcl_interfaces/msg/NotAType', ''),
        ('service type /set_bool', 'std_srvs/srv/SetBool\n'),
        ('service find std_srvs/srv/Trigger', '/last_received\n/trigger\n'),
        ('service info /trigger', f'Type: {TRIGGER}\nClients count: 0\nServices count: 1\n'),
        ('action list', ''),
        (
            'action info /nothing --spin-time 0.2',
            'Action: /nothing\nAction clients: 0\nAction servers: 0\n',
        ),
    ],
)
def test_what_is_there_is_answered_as_by_ros2cli(ros2: Ros2, words: str, answer: str) -> None:
    """To the letter, sorted; hidden names only on request, before or behind the verb."""
    outcome = ros2(*words.split())
    assert (outcome.code, outcome.out, outcome.err) == (0, answer, '')


@pytest.mark.parametrize(
    ('words', 'problem'),
    [
        ('node info /taker', "Unable to find node '/taker'\nDid you mean '/talker'?\n"),
        ('topic info /chater', "Unknown topic '/chater'\nDid you mean '/chatter'"),
        ('topic type /joint_state', "'/joint_states'"),
        ('topic type /_hidden_chatter --spin-time 0.2', ''),
        ('service type /set_boll', "'/set_bool'"),
        ('service info /triger', "Unknown service '/triger'\nDid you mean '/trigger'?\n"),
        ('action type /nothing --spin-time 0.2', ''),
    ],
)
def test_what_is_not_there_is_answered_with_the_nearest(
    ros2: Ros2, words: str, problem: str
) -> None:
    """Exit code 1 with nothing on stdout; the sentence of ros2cli and the hint are on stderr."""
    outcome = ros2(*words.split())
    assert (outcome.code, outcome.out) == (1, '')
    assert problem in outcome.err


def test_node_info_shows_hidden_names_on_request(ros2: Ros2) -> None:
    """`--include-hidden` adds what starts with an underscore; a leading slash may be missing."""
    shown = ros2('node', 'info', 'talker', '--include-hidden').lines
    assert shown[0] == '/talker'
    assert '    /_hidden_chatter: std_msgs/msg/String' in shown


def test_topic_list_verbose(ros2: Ros2) -> None:
    """Two blocks with counts."""
    out = ros2('topic', 'list', '-v').out
    published, subscribed = out.split('\nSubscribed topics:\n')
    assert published.startswith('Published topics:\n')
    assert ' * /chatter [std_msgs/msg/String] 1 publisher\n' in published
    assert ' * /mixed [std_msgs/msg/String] 2 publishers\n' in published
    assert ' * /listener/input [std_msgs/msg/String] 1 subscriber\n' in subscribed
    assert '/chatter' not in subscribed


def test_topic_info_verbose(ros2: Ros2) -> None:
    """Each endpoint with node, type hash and QoS."""
    out = ros2('topic', 'info', '-v', '/chatter').out
    head = 'Type: std_msgs/msg/String\n\nPublisher count: 1\n\n'
    assert re.fullmatch(f'{head}{ENDPOINT}\nSubscription count: 0\n\n', out), out


def test_service_list(ros2: Ros2) -> None:
    """Names with types, hidden ones on request."""
    lines = ros2('service', 'list', '-t', '--include-hidden-services').lines
    assert '/trigger [std_srvs/srv/Trigger]' in lines
    assert '/_hidden_service [std_srvs/srv/Trigger]' in lines
    assert lines == sorted(lines)
