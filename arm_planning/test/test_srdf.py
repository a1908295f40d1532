# SPDX-FileCopyrightText: 2026 The arm and quad developers
# SPDX-License-Identifier: Apache-2.0
"""SRDFs are made of a description alone, and refreshed without loss."""

from __future__ import annotations

import re

import pytest
from urdf_reader import find_group, parse_srdf, read_urdf

from arm_model import ModelError, pose_quality, RobotModel
from arm_planning import make_srdf

pytestmark = pytest.mark.slow

SAMPLES = 1000
LINK = '<link name="{0}"><collision><origin xyz="{1}"/><geometry>{2}</geometry></collision></link>'
JOINT = (
    '<joint name="to_{1}" type="revolute"><parent link="{0}"/><child link="{1}"/>'
    '<origin xyz="{2}"/><axis xyz="{3}"/>'
    '<limit lower="-2.5" upper="2.5" velocity="1" effort="1"/></joint>'
)


def link(name: str, place: str = '0 0 0', shape: str = '<sphere radius="0.02"/>') -> str:
    """Return a link with a small shape."""
    return LINK.format(name, place, shape)


def joint(parent: str, child: str, place: str = '0 0 0.3', axis: str = '0 1 0') -> str:
    """Return a joint with the name of its child."""
    return JOINT.format(parent, child, place, axis)


def robot(*parts: str) -> str:
    """Return a URDF."""
    return f'<robot name="made_up">{"".join(parts)}</robot>'


def arm(prefix: str, root: str, place: str) -> list[str]:
    """Return four joints about changing axes, 0.3 m apart."""
    names = [root, *(f'{prefix}{number}' for number in range(1, 5))]
    places, axes = [place, *['0 0 0.3'] * 3], ['0 0 1', '0 1 0', '1 0 0', '0 1 0']
    return [
        part
        for parent, child, at, axis in zip(names, names[1:], places, axes, strict=False)
        for part in (link(child), joint(parent, child, at, axis=axis))
    ]


PIN = '<sphere radius="0.006"/>'
PINS = robot(
    link('base', '0.3 0 1.0', PIN),
    *(link('a'), joint('base', 'a', '0 0 0.3', axis='0 0 1')),
    *(link('b'), joint('a', 'b', axis='0 1 0')),
    *(link('c', '0 0 0.5', PIN), joint('b', 'c', '0 0 0')),
)
"""A robot whose last link touches its base in few poses."""


def reasons(text: str) -> dict[frozenset[str], str]:
    """Return the reason of each pair."""
    found = re.findall(r'link1="(\w+)" link2="(\w+)" reason="([^"]*)"', text)
    return {frozenset((first, second)): reason for first, second, reason in found}


def test_pairs_by_how_they_touch() -> None:
    """Adjacent, always and never are named; what can touch at times is checked."""
    urdf = robot(
        link('base', '0 0 0.31'),
        *(link('a'), joint('base', 'a', axis='0 0 1')),  # turns within the base's sphere
        *(link('b', '0 0 -0.3'), joint('a', 'b', '0 0 0.3', axis='0 0 1')),  # reaches back
        *(link('c', '0 0 0.3'), joint('b', 'c', '0.3 0 0')),
        *(link('d', '0 0 -0.3'), joint('c', 'd', '0 0 0.3', axis='1 0 0')),
        *(link('e', '0 0 0.1'), joint('d', 'e', '0 0 0.3')),
    )
    draft = make_srdf(urdf, samples=SAMPLES)
    found = reasons(draft.text)
    adjacent = ['base a', 'a b', 'b c', 'c d', 'd e']
    assert {pair for pair, reason in found.items() if reason == 'Adjacent'} == {
        frozenset(each.split()) for each in adjacent
    }
    assert found[frozenset(('base', 'b'))] == 'Always'
    assert found[frozenset(('c', 'e'))] == 'Never'
    assert any('never in contact' in line for line in draft.report)
    assert any('probability of 0.0001' in line for line in draft.report)


def test_a_contact_that_is_rare_is_found() -> None:
    """Two pins meet in one pose of ten thousand: samples miss it, the search does not."""
    draft = make_srdf(PINS, samples=SAMPLES)
    pair = frozenset(('base', 'c'))
    assert pair not in reasons(draft.text)
    assert 'base and c' in next(line for line in draft.report if line.startswith('checked'))


def test_groups_from_chains() -> None:
    """Two arms on one base are two groups; the pose ``ready`` of each is good to start from."""
    urdf = robot(link('base'), *arm('left', 'base', '0 1 0'), *arm('right', 'base', '0 -1 0'))
    text = make_srdf(urdf, samples=SAMPLES).text
    tree, semantic = read_urdf(urdf), parse_srdf(text)
    assert semantic.arms == ('arm_left4', 'arm_right4')
    for group in semantic.arms:
        assert len(find_group(tree, semantic, group).joints) == 4
        model = RobotModel(urdf, text, {name: {} for name in tree.ranges()}, group)
        assert pose_quality(model, model.poses['ready']) > 0.0


def test_what_others_leave_out_is_added() -> None:
    """Groups where an SRDF has pairs only, of which a person's own stays.

    Limits of joints that the limits file lacks are those of the description: the wheels of a
    mobile arm have no drive on the bus of the arm.
    """
    wheel = link('wheel'), joint('base', 'wheel', '0 0.5 0')
    urdf = robot(link('base'), *wheel, *arm('left', 'base', '0 1 0'))
    mine = '<disable_collisions link1="left1" link2="left4" reason="User says so"/>'
    limits = {f'to_left{number}': {'max_velocity': 0.5} for number in range(1, 5)}
    text = make_srdf(urdf, f'<robot name="made_up">{mine}\n</robot>', limits, SAMPLES).text
    semantic = parse_srdf(text)
    assert 'arm_left4' in semantic.arms
    assert 'ready' in semantic.poses['arm_left4']
    assert reasons(text)[frozenset(('left1', 'left4'))] == 'User says so'


def test_a_gripper_is_an_end_effector() -> None:
    """Two fingers at the end are no arms; the arm ends where they begin."""
    one, two = (
        joint('arm4', name, '0 0 0.1', '1 0 0').replace('revolute', 'prismatic')
        for name in ('one', 'two')
    )
    two = two.replace('</joint>', '<mimic joint="to_one"/></joint>')
    fingers = f'{link("one")}{one}{link("two")}{two}'.replace('-2.5', '0').replace('2.5', '0.04')
    urdf = robot(link('base'), *arm('arm', 'base', '0 0 0.1'), fingers)
    semantic = parse_srdf(make_srdf(urdf, samples=SAMPLES).text)
    (effector,) = semantic.end_effectors
    assert (effector.parent_link, effector.parent_group) == ('arm4', 'arm')
    assert semantic.groups[effector.group].links == ('one', 'two')
    assert semantic.arms == ('arm',)


def test_what_a_person_wrote_stays() -> None:
    """Groups, poses, comments and pairs of the user; other pairs that can touch are removed."""
    made = make_srdf(PINS, samples=SAMPLES).text
    own = '  <disable_collisions link1="base" link2="b" reason="User: it is soft"/>\n'
    wrong = '  <disable_collisions link1="base" link2="c" reason="Never"/>\n'
    gone = '  <disable_collisions link1="a" link2="nose" reason="Never"/>\n'
    comment = '  <!-- mine -->\n'
    mine = made.replace('  <group ', f'{comment}  <group ', 1)
    mine = mine.replace('</robot>', f'{own}{wrong}{gone}</robot>')
    draft = make_srdf(PINS, mine, samples=SAMPLES)
    assert comment in draft.text
    assert reasons(draft.text)[frozenset(('base', 'b'))] == 'User: it is soft'
    assert frozenset(('base', 'c')) not in reasons(draft.text)
    removed = [line for line in draft.report if line.startswith('removed')]
    assert ('nose is not in' in removed[0], 'base and c can touch' in removed[1]) == (True, True)
    assert make_srdf(PINS, draft.text, samples=SAMPLES).text == draft.text


@pytest.mark.parametrize(
    ('urdf', 'previous', 'reason'),
    [
        ('<robot', '', 'XML'),
        (robot(link('base')), '', 'no group to make'),
        (robot(link('base'), *arm('arm', 'base', '0 0 0.1')), '<robot', 'the SRDF is no XML'),
    ],
)
def test_what_cannot_be_used_is_refused(urdf: str, previous: str, reason: str) -> None:
    """With the reason."""
    with pytest.raises(ModelError, match=reason):
        make_srdf(urdf, previous, samples=SAMPLES)
