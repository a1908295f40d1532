# SPDX-FileCopyrightText: 2026 The arm and quad developers
# SPDX-License-Identifier: Apache-2.0
"""QoS profiles as metadata.yaml and files with overrides have them."""

from __future__ import annotations

from dataclasses import fields
from typing import Any

from hypothesis import given, strategies
import pytest

from rosbag_files import BagError, OfferedQos, read_qos, UNLIMITED

DURATION = strategies.integers(min_value=1, max_value=UNLIMITED)
PROFILES = strategies.builds(
    OfferedQos,
    strategies.sampled_from(['keep_last', 'keep_all', 'unknown', 'system_default']),
    strategies.integers(min_value=0, max_value=10_000),
    strategies.sampled_from(['reliable', 'best_effort']),
    strategies.sampled_from(['volatile', 'transient_local']),
    DURATION,
    DURATION,
    strategies.sampled_from(['automatic', 'manual_by_topic']),
    DURATION,
    strategies.booleans(),
)


@given(PROFILES)
def test_round_trip(qos: OfferedQos) -> None:
    """What is written is read."""
    assert read_qos(qos.to_dict(), 'test') == qos


def test_numbers_of_older_versions() -> None:
    """Before version 9 policies were numbers."""
    found = read_qos({'history': 1, 'depth': 5, 'reliability': 2, 'durability': 1}, 'test')
    assert (found.history, found.reliability) == ('keep_last', 'best_effort')
    assert found.durability == 'transient_local'


@pytest.mark.parametrize('name', [field.name for field in fields(OfferedQos)])
def test_one_field_is_enough(name: str) -> None:
    """The others have their defaults."""
    values = OfferedQos().to_dict()
    assert read_qos({name: values[name]}, 'test') == OfferedQos()


@pytest.mark.parametrize(
    ('values', 'problem'),
    [
        ({'reliabilty': 'reliable'}, "unknown key 'reliabilty'; choose from history, depth"),
        ({'reliability': 'sure'}, "unknown reliability 'sure'; choose one of system_default"),
        ({'reliability': 9}, 'unknown reliability 9'),
        ({'depth': -1}, 'depth is -1'),
        ({'depth': True}, 'depth is True'),
        ({'deadline': 3}, 'deadline is 3; write it as'),
        ({'deadline': {'sec': -1}}, 'deadline is'),
        ([], 'is a mapping'),
    ],
)
def test_wrong_values_are_named(values: Any, problem: str) -> None:
    """With the place and a remedy."""
    with pytest.raises(BagError, match=f'^/topic: .*{problem}'):
        read_qos(values, '/topic')
