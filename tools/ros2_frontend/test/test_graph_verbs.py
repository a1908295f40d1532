# SPDX-FileCopyrightText: 2026 The arm and quad developers
# SPDX-License-Identifier: Apache-2.0
"""`list`, `info`, `type` and `find` of nodes, topics and services, against real nodes."""

from __future__ import annotations

import re

from frontend_cli import Ros2
import pytest

pytestmark = [pytest.mark.scenario, pytest.mark.usefixtures('zoo')]

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


def test_node_list_names_the_visible_nodes(ros2: Ros2) -> None:
    """Full names, sorted, without the hidden node and without our own."""
    outcome = ros2('node', 'list')
    assert (outcome.code, outcome.lines) == (0, ['/factory/worker', '/machine', '/talker'])


def test_node_list_all_and_count(ros2: Ros2) -> None:
    """`-a` adds hidden nodes, ours included; `-c` prints only how many."""
    assert ros2('node', 'list', '-a', '-c').out == '5\n'


def test_node_info_is_ros2clis_to_the_letter(ros2: Ros2) -> None:
    """Six blocks; an empty one is one empty line."""
    outcome = ros2('node', 'info', '/factory/worker')
    assert (outcome.code, outcome.out, outcome.err) == (0, INFO_OF_WORKER, '')


def test_node_info_shows_hidden_names_on_request(ros2: Ros2) -> None:
    """`--include-hidden` adds what starts with an underscore; a leading slash may be missing."""
    shown = ros2('node', 'info', 'talker', '--include-hidden').lines
    assert shown[0] == '/talker'
    assert '    /_hidden_chatter: std_msgs/msg/String' in shown


def test_node_info_of_nobody_suggests(ros2: Ros2) -> None:
    """ros2cli's sentence, then the nearest name."""
    outcome = ros2('node', 'info', '/taker')
    assert (outcome.code, outcome.out) == (1, '')
    assert outcome.err == "Unable to find node '/taker'\nDid you mean '/talker'?\n"


def test_topic_list(ros2: Ros2) -> None:
    """Names, sorted, with their types on request."""
    outcome = ros2('topic', 'list', '-t')
    assert outcome.lines == [f'{name} [{type_}]' for name, type_ in TOPICS.items()]
    assert outcome.code == 0


def test_hidden_topics_are_shown_on_request(ros2: Ros2) -> None:
    """The switch works before and behind the verb; `-c` prints only how many."""
    assert ros2('topic', '--include-hidden-topics', 'list').lines == ['/_hidden_chatter', *TOPICS]
    count = ros2('topic', 'list', '--include-hidden-topics', '-c')
    assert count.out == f'{len(TOPICS) + 1}\n'


def test_topic_list_verbose(ros2: Ros2) -> None:
    """Two blocks with counts."""
    out = ros2('topic', 'list', '-v').out
    published, subscribed = out.split('\nSubscribed topics:\n')
    assert published.startswith('Published topics:\n')
    assert ' * /chatter [std_msgs/msg/String] 1 publisher\n' in published
    assert ' * /mixed [std_msgs/msg/String] 2 publishers\n' in published
    assert ' * /listener/input [std_msgs/msg/String] 1 subscriber\n' in subscribed
    assert '/chatter' not in subscribed


def test_topic_info(ros2: Ros2) -> None:
    """Type and counts."""
    expected = 'Type: std_msgs/msg/String\nPublisher count: 1\nSubscription count: 0\n'
    assert ros2('topic', 'info', '/chatter').out == expected


def test_topic_info_verbose(ros2: Ros2) -> None:
    """Each endpoint with node, type hash and QoS."""
    out = ros2('topic', 'info', '-v', '/chatter').out
    head = 'Type: std_msgs/msg/String\n\nPublisher count: 1\n\n'
    assert re.fullmatch(f'{head}{ENDPOINT}\nSubscription count: 0\n\n', out), out


def test_topic_info_of_an_unknown_topic_suggests(ros2: Ros2) -> None:
    """ros2cli's sentence, then the nearest name."""
    outcome = ros2('topic', 'info', '/chater')
    assert (outcome.code, outcome.out) == (1, '')
    assert outcome.err.splitlines()[0] == "Unknown topic '/chater'"
    assert outcome.err.splitlines()[1].startswith("Did you mean '/chatter'")


def test_topic_type(ros2: Ros2) -> None:
    """The type alone, for pipes into `interface show -`."""
    assert ros2('topic', 'type', '/joint_states').out == 'sensor_msgs/msg/JointState\n'


def test_topic_type_of_an_unknown_topic(ros2: Ros2) -> None:
    """Exit code 1 with nothing on stdout, as ros2cli; the hint is on stderr."""
    outcome = ros2('topic', 'type', '/joint_state')
    assert (outcome.code, outcome.out) == (1, '')
    assert "'/joint_states'" in outcome.err


def test_topic_type_of_a_hidden_topic_needs_the_switch(ros2: Ros2) -> None:
    """Hidden topics are unknown by default."""
    assert ros2('topic', 'type', '/_hidden_chatter', '--spin-time', '0.2').code == 1
    assert ros2('topic', '--include-hidden-topics', 'type', '/_hidden_chatter').code == 0


def test_topic_find(ros2: Ros2) -> None:
    """The topics of a type; none of an unknown type, which is no error."""
    found = ros2('topic', 'find', 'sensor_msgs/msg/JointState')
    assert found.lines == ['/joint_states', '/listener/stamped']
    nothing = ros2('topic', 'find', 'rcl_interfaces/msg/NotAType')
    assert (nothing.code, nothing.out) == (0, '')


def test_service_list(ros2: Ros2) -> None:
    """Names with types, hidden ones on request."""
    lines = ros2('service', 'list', '-t', '--include-hidden-services').lines
    assert '/trigger [std_srvs/srv/Trigger]' in lines
    assert '/_hidden_service [std_srvs/srv/Trigger]' in lines
    assert lines == sorted(lines)


def test_service_type_and_find(ros2: Ros2) -> None:
    """The type of a name and the names of a type."""
    assert ros2('service', 'type', '/set_bool').out == 'std_srvs/srv/SetBool\n'
    assert ros2('service', 'find', 'std_srvs/srv/Trigger').lines == ['/last_received', '/trigger']
    unknown = ros2('service', 'type', '/set_boll')
    assert (unknown.code, unknown.out) == (1, '')
    assert "'/set_bool'" in unknown.err


def test_service_info(ros2: Ros2) -> None:
    """Type and counts, or the sentence of ros2cli."""
    expected = 'Type: std_srvs/srv/Trigger\nClients count: 0\nServices count: 1\n'
    assert ros2('service', 'info', '/trigger').out == expected
    unknown = ros2('service', 'info', '/triger')
    assert unknown.code == 1
    assert unknown.err == "Unknown service '/triger'\nDid you mean '/trigger'?\n"


def test_an_empty_list_of_actions(ros2: Ros2) -> None:
    """Nothing and exit code 0; `info` counts none, `type` has exit code 1."""
    assert ros2('action', 'list').out == ''
    info = ros2('action', 'info', '/nothing', '--spin-time', '0.2')
    assert (info.code, info.out) == (
        0,
        'Action: /nothing\nAction clients: 0\nAction servers: 0\n',
    )
    assert ros2('action', 'type', '/nothing', '--spin-time', '0.2').code == 1
