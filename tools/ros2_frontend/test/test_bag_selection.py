# SPDX-FileCopyrightText: 2026 The arm and quad developers
# SPDX-License-Identifier: Apache-2.0
"""Which topics are recorded, what was lost of them, and what `info` prints."""

from __future__ import annotations

from argparse import Namespace
import re
from typing import Any

from hypothesis import given, strategies
import pytest

from ros2_frontend.bag import topic_filter
from ros2_frontend.ros.bag_qos import for_playing, for_recording, is_compatible
from ros2_frontend.ros.recorder import _Subscribed
from ros2_frontend.verbs.bag_info import info_text
from rosbag_files import BagFile, BagMetadata, OfferedQos, Topic, TopicCount

TYPE = 'std_msgs/msg/String'


@pytest.mark.parametrize(
    ('options', 'accepted'),
    [
        ({'everything': True}, ['/chatter', '/arm/joint_states']),
        ({'everything': True, 'hidden': True}, ['/chatter', '/arm/joint_states', '/_hidden']),
        ({'topics': ['chatter', '/_hidden']}, ['/chatter', '/_hidden']),
        ({'topic_types': [TYPE]}, ['/chatter', '/arm/joint_states']),
        ({'regex': 'joint'}, ['/arm/joint_states']),
        ({'everything': True, 'exclude_regex': '^/arm'}, ['/chatter']),
        ({'everything': True, 'exclude_topics': ['/chatter']}, ['/arm/joint_states']),
        ({'everything': True, 'exclude_topic_types': [TYPE]}, []),
        ({}, []),
    ],
)
def test_topics_are_chosen_and_left_out(options: Any, accepted: list[str]) -> None:
    """As rosbag2 does; what is left out wins."""
    chosen: dict[str, Any] = {'topics': (), 'regex': '', 'exclude_topics': (), 'exclude_regex': ''}
    chosen |= {'everything': False, 'hidden': False} | options
    everything, hidden = chosen.pop('everything'), chosen.pop('hidden')
    accepts = topic_filter(Namespace(**chosen), everything, hidden)
    names = ['/chatter', '/arm/joint_states', '/_hidden']
    assert [name for name in names if accepts(name, TYPE)] == accepted


def test_gaps_of_one_publisher_are_counted() -> None:
    """Not those of another, also before the graph shows it; what was counted stays."""
    topic = _Subscribed(Topic('/a', TYPE), None, OfferedQos())
    steps: list[tuple[set[bytes], list[int | None]]]
    steps = [({b'one'}, [1, 2, 5]), ({b'one'}, [900, 6]), ({b'one', b'two'}, [2000])]
    for publishers, numbers in [*steps, ({b'two'}, [50, 1, None, 7]), ({b'two'}, [])]:
        topic.confirm(publishers)
        for number in numbers:
            topic.receive(number)
    assert topic.lost == 2


def test_info_has_the_form_of_rosbag2() -> None:
    """To the letter; times in the local zone are left to the pattern."""
    files = (BagFile('bag_0.mcap', 10**18, 2_500_000_000, 3), BagFile('bag_1.mcap', 0, 0, 0))
    topics = tuple(TopicCount(Topic(name, TYPE), count) for name, count in (('/b', 1), ('/a', 2)))
    text = info_text(BagMetadata(files, topics), 2048)
    topic = r'Topic: {} \| Type: std_msgs/msg/String \| Count: {} \| '
    assert re.fullmatch(
        r'\nFiles:             bag_0.mcap\n'
        r'                   bag_1.mcap\n'
        r'Bag size:          2.0 KiB\n'
        r'Storage id:        mcap\n'
        r'ROS Distro:        jazzy\n'
        r'Duration:          2.500000000s\n'
        r'Start:             Sep +\d 2001 ..:..:40.000000000 \(1000000000.000000000\)\n'
        r'End:               Sep +\d 2001 ..:..:42.500000000 \(1000000002.500000000\)\n'
        r'Messages:          3\n'
        rf'Topic information: {topic.format("/a", 2)}Serialization Format: cdr\n'
        rf'                   {topic.format("/b", 1)}Serialization Format: cdr\n'
        r'Service:           0\n'
        r'Service information: ',
        text,
    ), text


RELIABLE, LATCHED = OfferedQos(), OfferedQos(durability='transient_local')
BEST_EFFORT = OfferedQos(reliability='best_effort')
OFFERS = strategies.lists(strategies.sampled_from([RELIABLE, LATCHED, BEST_EFFORT]), min_size=1)


@given(OFFERS)
def test_a_recorder_connects_to_all_publishers(offers: list[OfferedQos]) -> None:
    """And gets what was kept, and repeated, where all publishers offer that."""
    qos = for_recording(offers)
    assert all(is_compatible(qos, offer) for offer in offers)
    assert (qos.durability == 'transient_local') == all(offer == LATCHED for offer in offers)
    assert (qos.reliability == 'reliable') == (BEST_EFFORT not in offers)


@given(OFFERS)
def test_a_player_offers_what_was_offered(offers: list[OfferedQos]) -> None:
    """A subscription of then that all publishers served is served now."""
    qos = for_playing(offers)
    if len(set(offers)) == 1:
        assert (qos.reliability, qos.durability) == (offers[0].reliability, offers[0].durability)
    else:
        assert qos.durability == 'volatile' or all(offer == LATCHED for offer in offers)
