# SPDX-FileCopyrightText: 2026 The arm and quad developers
# SPDX-License-Identifier: Apache-2.0
"""The robot model, its names and its trees against numbers of arms, differences, broken files."""

from __future__ import annotations

from collections.abc import Callable
from itertools import combinations
import math
from pathlib import Path
from typing import Any

from hypothesis import given, settings
from hypothesis import strategies as st
from model_robots import chain, chain_texts, ready, robot, ROBOTS, table, texts, two_arms
import numpy as np
import pinocchio as pin
import pytest

import arm_model
import arm_model as am


def test_each_group_is_an_arm_of_its_own() -> None:
    """An arm alone is a chain from the torso; both are no chain, with the last arm's tip."""
    left, both = two_arms('left'), two_arms()
    assert left.joints == ('left_1', 'left_2', 'left_3')
    assert (left.base, left.tip, left.serial) == ('torso_link', 'left_3_link', True)
    assert set(both.joints) == {'torso', *left.joints, 'right_1', 'right_2'}
    assert (both.base, both.tip, both.serial) == ('base', 'right_2_link', False)
    assert both.limits.continuous.tolist() == [name == 'right_2' for name in both.joints]


def test_arms_are_parted_by_their_own_joints_and_not_by_the_torso() -> None:
    """The torso turns both; the joints of one arm are one way, those of the other the other."""
    model = two_arms()
    pair = model.pairs.index(('left_3_link', 'right_2_link'))
    signs = dict(zip(model.joints, model.scene.relative_motion_sign[pair], strict=True))
    assert signs['torso'] == 0.0
    assert {signs[name] for name in ('left_1', 'left_2', 'left_3')} == {-1.0}
    assert {signs[name] for name in ('right_1', 'right_2')} == {1.0}


@settings(max_examples=20, deadline=None)
@given(seed=st.integers(0, 10**6))
def test_joints_beside_a_group_stand_where_they_are_said_to(seed: int) -> None:
    """Poses and distances are those of the whole robot; the first model stays as it is.

    A place that is no number is refused by the joint's name.
    """
    left, both = two_arms('left'), two_arms()
    everywhere = np.random.default_rng(seed).uniform(-1.2, 1.2, len(both))
    state = dict(zip(both.joints, everywhere.tolist(), strict=True))
    here = np.array([state[name] for name in left.joints])
    before = left.kinematics.link_pose('right_2_link', here)
    moved = left.with_others(state)
    assert moved.kinematics.others == {name: state[name] for name in left.kinematics.others}
    for link in moved.frames:
        pose = moved.kinematics.link_pose(link, here)
        whole = both.kinematics.link_pose(link, everywhere)
        assert pose.position == pytest.approx(whole.position, abs=1e-12)
        assert pose.rotation == pytest.approx(whole.rotation, abs=1e-12)
    distances, least = (
        dict(zip(model.pairs, am.Clearances(model.scene).least(at, math.inf), strict=True))
        for model, at in ((both, everywhere), (moved, here))
    )
    assert least == pytest.approx({pair: distances[pair] for pair in moved.pairs}, abs=1e-9)
    assert moved.clearance(here) == pytest.approx(min(least.values()))
    again = left.kinematics.link_pose('right_2_link', here)
    assert again.position.tolist() == before.position.tolist()
    assert left.with_others({'left_1': 0.5, 'right_1': 0.0}) is left
    with pytest.raises(am.CommandError, match='right_1: its position is nan'):
        left.with_others({'right_1': math.nan})


ARRAYS = {'Array', 'ArmNames', 'Mask', 'Native', 'Places', 'Shape', 'checked', 'frozen'}

README = Path(__file__).parents[1] / 'README.md'


@pytest.mark.parametrize('name', ROBOTS)
def test_names_are_those_of_the_model(name: str) -> None:
    """The description alone is enough for the joints: the longest chain."""
    model, found = robot(name), am.names_of(*texts(name))
    assert (found.joints, found.base, found.tool) == (model.joints, model.base, model.tip)
    assert am.names_of(texts(name)[0]).joints == model.joints


def test_names_of_broken_texts_are_refused() -> None:
    """In words: no XML, a chain that is not there, a description that bites its tail."""
    urdf, srdf, _ = chain_texts('xyz')
    loop = ''.join(
        f'<link name="{a}"/><joint name="{a}" type="fixed"><parent link="{a}"/>'
        f'<child link="{b}"/></joint>'
        for a, b in ('xy', 'yx')
    )
    for words, *broken in (
        ('no XML', '<robot'),
        ("no group 'leg'", urdf, srdf, 'leg'),
        ("no link 'nowhere'", urdf, srdf.replace('"base"', '"nowhere"')),
        ('loop', f'<robot name="r">{loop}</robot>'),
    ):
        with pytest.raises(am.ModelError, match=words):
            am.names_of(*broken)


def test_the_public_names_are_in_the_table() -> None:
    """All but those of arrays."""
    table = README.read_text(encoding='utf-8').partition('## Public API')[2].partition('\n## ')[0]
    missing = {name for name in arm_model.__all__ if f'`{name}`' not in table}
    assert missing == ARRAYS


LIMIT = '<limit lower="-2" upper="2" velocity="2" effort="1"/>'  # of :func:`chain_texts`
CHAINS = ('zyy', 'zyyz', 'zyyzy', 'cyyzyz', 'zpyzyzc', 'zyzyzyzy')
TIPS = ('left_3_link', 'right_2_link', 'torso_link')  # of two arms

# pose, position of the tip in [m]: numbers of the makers
CHECKS = [
    ('panda', [0.0] * 7, (0.088, 0.0, 0.926)),
    ('panda_hand_tcp', [0.0, -0.785, 0.0, -2.356, 0.0, 1.571, 0.785], (0.3070, 0.0, 0.4869)),
    ('panda', [0.0, -0.785, 0.0, -2.356, 0.0, 1.571, 0.785], (0.3070, 0.0, 0.5903)),
    ('prbt', [0.0] * 6, (0.0, 0.0, 1.0014)),
    ('prbt', [0.0, 0.0, math.pi / 2, 0.0, math.pi / 2, 0.0], (-0.307, 0.0, 0.5264)),
    ('gp110', [0.0] * 6, (1.540, 0.0, 1.645)),
    ('gp110', [0.0, 0.0, 0.0, 0.0, -math.pi / 2, 0.0], (1.340, 0.0, 1.445)),
]


def twist_between(before: am.Pose, after: am.Pose) -> am.Array:
    """Return the twist from one pose to another in unit time."""
    angular = pin.log3(after.rotation @ before.rotation.T)
    return np.concatenate((after.position - before.position, angular))


def any_position(model: am.RobotModel, seed: int) -> am.Array:
    """Return joint positions within the limits."""
    lower = np.maximum(model.limits.lower, -math.pi)
    upper = np.minimum(model.limits.upper, math.pi)
    return np.random.default_rng(seed).uniform(lower, upper)


@pytest.mark.parametrize(('name', 'positions', 'xyz'), CHECKS)
def test_the_tip_is_where_the_maker_says(
    name: str, positions: list[float], xyz: tuple[float, float, float]
) -> None:
    """Forward kinematics meets the check poses; any link at the end can be the tip."""
    model = robot(name.partition('_')[0])
    if '_' in name:
        model = am.RobotModel(*texts(model.name), table(model.name), tip=name)
    assert model.pose(np.array(positions)).position == pytest.approx(xyz, abs=1e-4)


@pytest.mark.parametrize(
    'model',
    [*map(robot, ROBOTS), *map(chain, CHAINS), *(two_arms(tip=tip) for tip in TIPS)],
    ids=[*ROBOTS, *CHAINS, *TIPS],
)
@settings(max_examples=15, deadline=None)
@given(seed=st.integers(0, 10**6))
def test_jacobians_are_differences(model: am.RobotModel, seed: int) -> None:
    """Of chains of 3 to 8 joints and of a tree the Jacobian is the difference of the pose."""
    at, step = any_position(model, seed), 1e-6
    differences = [
        twist_between(model.pose(at - step * unit), model.pose(at + step * unit)) / (2 * step)
        for unit in np.eye(len(model))
    ]
    assert model.jacobian(at) == pytest.approx(np.array(differences).T, abs=1e-7)


GP110 = {  # the data sheet's ranges and speeds in degrees, joint by joint
    'lower': [-180, -90, -80, -360, -125, -360],
    'upper': [180, 155, 90, 360, 125, 360],
    'velocity': [140, 110, 130, 175, 175, 255],
}
SELDOM = {'panda': 'panda_link2 panda_link6', 'gp110': 'link_4_r link_6_t'}


@pytest.mark.parametrize('name', ROBOTS)
def test_named_poses_are_free(name: str) -> None:
    """The pose to start from is neither in contact nor singular; pairs are those of links."""
    model = robot(name)
    assert all(model.clearance(pose) > 0.0 for pose in model.poses.values())
    assert model.clearance(ready(name)) > 0.02
    assert np.linalg.svd(model.jacobian(ready(name)))[1][-1] > 0.1
    # links that seldom meet are checked; a cylinder with two spheres is one capsule
    pairs = [frozenset(pair) for pair in model.pairs]
    assert name != 'panda' or len(pairs) == len(set(pairs))
    assert name not in SELDOM or frozenset(SELDOM[name].split()) in pairs
    for field, degrees in GP110.items() if name == 'gp110' else ():
        assert np.degrees(getattr(model.limits, field)) == pytest.approx(degrees, abs=0.01)


def test_a_wheel_beside_the_arm_needs_no_limits() -> None:
    """Public descriptions write velocity 0 for continuous joints, or no <limit> at all."""
    urdf, srdf, limits = chain_texts('zyy')
    for name, limit in (('left', ''), ('right', '<limit effort="0" velocity="0"/>')):
        wheel = (
            f'<link name="{name}"/><joint name="{name}" type="continuous"><parent link="base"/>'
            f'<child link="{name}"/>{limit}</joint></robot>'
        )
        urdf = urdf.replace('</robot>', wheel)
    model = am.RobotModel(urdf, srdf, limits)
    assert model.joints == ('j1', 'j2', 'j3')
    assert 'left' in model.frames


@pytest.mark.parametrize(
    ('soft', 'entry', 'wanted'),
    [
        ('soft_lower_limit="-1" soft_upper_limit="3"', {}, (-1.0, 2.0)),
        ('soft_lower_limit="-1" soft_upper_limit="1"', {'min_position': -1.5, 'max_position': 1.5},
         (-1.5, 1.5)),
        ('', {}, (-2.0, 2.0)),
    ],
)  # fmt: skip
def test_soft_limits_narrow_a_joint(
    soft: str, entry: dict[str, float], wanted: tuple[float, float]
) -> None:
    """As in MoveIt: a limits file comes before them; some controllers have gains alone."""
    urdf, srdf, limits = chain_texts('zyy')
    urdf = urdf.replace(LIMIT, f'{LIMIT}<safety_controller k_velocity="20" {soft}/>', 1)
    model = am.RobotModel(urdf, srdf, {**limits, 'j1': {**limits['j1'], **entry}})
    assert (model.limits.lower[0], model.limits.upper[0]) == wanted


Texts = tuple[str, str, dict[str, Any]]


def entry(**values: object) -> Callable[[Texts], Texts]:
    """Return what changes the limits file's entry of a joint."""

    def changed(texts: Texts) -> Texts:
        urdf, srdf, limits = texts
        return urdf, srdf, {**limits, 'j2': {**limits['j2'], **values}}

    return changed


BROKEN: dict[str, tuple[Callable[[Texts], Texts], str]] = {
    'no joint': (lambda t: (*t[:2], {'other': t[2]['j1']}), 'joint j1 is missing'),
    'no table': (lambda t: (*t[:2], {**t[2], 'j2': None}), 'j2 .*a table is needed'),
    'negative jerk': (entry(max_jerk=-1.0), 'max_jerk is -1'),
    'word for a number': (entry(max_jerk='high'), "'high'"),
    'wider velocity': (entry(max_velocity=3.0), 'wider than the description'),
    'wider positions': (entry(min_position=-3, max_position=1), 'wider than the description'),
    'shortened key': (entry(has_jerk=True), r"'has_jerk' \(is 'has_jerk_limits' meant"),
    'misspelt key': (entry(max_yerk=1.0), r"'max_yerk' \(is 'max_jerk' meant"),
    'no group': (lambda t: (t[0], '<robot name="chain"/>', t[2]), 'groups none'),
    'srdf no xml': (lambda t: (t[0], '<robot', t[2]), 'SRDF is no XML'),
    'urdf no xml': (lambda t: ('<robot', *t[1:]), 'description is no XML'),
    'unknown tip': (lambda t: (t[0], t[1].replace('"tip"', '"top"'), t[2]), "'top'"),
    'no effort': (lambda t: (t[0].replace(' effort="1"', ''), *t[1:]), 'j1: <limit> has no eff'),
    'no limit': (lambda t: (t[0].replace(LIMIT, ''), *t[1:]), 'needs <limit'),
}


@pytest.mark.parametrize(('broken', 'words'), BROKEN.values(), ids=BROKEN.keys())
def test_broken_files_are_refused(broken: Callable[[Texts], Texts], words: str) -> None:
    """What does not make an arm is refused in words that name it."""
    with pytest.raises(am.ModelError, match=words):
        am.RobotModel(*broken(chain_texts('zyy')))


def test_unknown_names_are_refused_with_the_known_ones() -> None:
    """Unknown groups, joints and links are refused, and those that exist are listed."""
    with pytest.raises(am.ModelError, match=r"'leg'.*groups: arm"):
        am.RobotModel(*chain_texts('zyy'), group='leg')
    with pytest.raises(am.CommandError, match='joints: j1, j2, j3'):
        chain('zyy').index('j4')
    with pytest.raises(am.CommandError, match='link_3'):
        chain('zyy').pose(np.zeros(3), 'hand')


def test_what_no_file_says_has_a_default_that_is_noted_once() -> None:
    """MoveIt's wizard writes no jerk, often no acceleration, and the description's velocity 0."""
    urdf, srdf, _ = chain_texts('zyp')
    wizard: dict[str, Any] = {'has_velocity_limits': True, 'max_velocity': 0}
    wizard |= {'has_acceleration_limits': False, 'max_acceleration': 0}
    table: dict[str, Any] = dict.fromkeys(('j1', 'j2', 'j3'), wizard)
    table['j2'] = {'has_acceleration_limits': True, 'max_acceleration': 5}
    model = am.RobotModel(urdf.replace('velocity="2"', 'velocity="0"'), srdf, table)
    assert model.limits.velocity.tolist() == [1.0, 1.0, 0.1]
    assert model.limits.acceleration.tolist() == [1.0, 5.0, 1.0]
    assert model.limits.jerk.tolist() == [20.0, 100.0, 20.0]
    defaults = [note for note in model.notes if note.startswith('no max_')]
    joints = [note.rpartition(': ')[2] for note in defaults]
    assert joints == ['j1, j2', 'j1', 'j1, j2, j3', 'j3', 'j3']
    units = [note.partition(':')[0].rpartition(' ')[2] for note in defaults]
    assert units == ['rad/s', 'rad/s2', 'max_acceleration', 'm/s', 'm/s2']
    del table['j1']  # the wizard leaves joints out that it asks no limits of
    assert am.RobotModel(urdf, srdf, table).limits.velocity.tolist() == [2.0] * 3


def test_poses_that_cannot_be_taken_are_noted() -> None:
    """A pose beyond a limit or without a joint is left out, and named."""
    urdf, srdf, limits = chain_texts('zyy')
    poses = ''
    for name, places in (('far', (9, 0, 0)), ('half', (0,)), ('zero', (0, 0, 0))):
        joints = [f'<joint name="j{n}" value="{at}"/>' for n, at in enumerate(places, 1)]
        poses += f'<group_state name="{name}" group="arm">{"".join(joints)}</group_state>'
    model = am.RobotModel(urdf, srdf.replace('</robot>', f'{poses}</robot>'), limits)
    assert list(model.poses) == ['zero']
    far, half = (note for note in model.notes if note.startswith('pose'))
    assert "'far'" in far
    assert "'half'" in half


def test_limits_files(tmp_path: Path) -> None:
    """Without the table, or no file at all, they are refused with their path.

    Packages of ROS 2 have it at the depth at which move_group reads it.
    """
    path = tmp_path / 'limits.yaml'
    with pytest.raises(am.ModelError, match=r'limits\.yaml'):
        am.load_limits(path)
    for text in ('joints: {}', '[1]', 'joint_limits: 3', 'a: {joint_limits: {}}'):
        path.write_text(text, encoding='utf-8')
        with pytest.raises(am.ModelError, match='joint_limits'):
            am.load_limits(path)
    for above in ('', 'robot_description_planning: ', '/**: {ros__parameters: '):
        table = '{joint_limits: {j1: {max_jerk: 9.0}}}'
        path.write_text(f'{above}{table}{"}" * above.count("{")}', encoding='utf-8')
        assert am.load_limits(path) == {'j1': {'max_jerk': 9.0}}


def test_links_may_be_checked_by_name_only() -> None:
    """A link without default checks is checked in the pairs that are enabled, and no others."""
    urdf, srdf, limits = chain_texts('zyyy')
    links = [f'link_{number}' for number in range(1, 5)]
    everything = set(map(frozenset, combinations(links, 2)))
    words = (
        '<disable_default_collisions link="link_1"/>'
        '<enable_collisions link1="link_4" link2="link_1"/>'
        '<enable_collisions link1="link_1" link2="link_3"/>'
        '<disable_collisions link1="link_1" link2="link_3"/></robot>'
    )
    model = am.RobotModel(urdf, srdf.replace('</robot>', words), limits)
    left = {pair for pair in everything if 'link_1' not in pair}
    assert set(map(frozenset, model.pairs)) == left | {frozenset(('link_1', 'link_4'))}


def test_files_are_read(tmp_path: Path) -> None:
    """As the constructor takes their texts; one that is not there is named."""
    files = am.example_files()
    urdf, srdf = files.urdf.read_text(), files.srdf.read_text()
    one, same = (
        am.RobotModel.from_files(*files),
        am.RobotModel(urdf, srdf, am.load_limits(files.limits)),
    )
    assert (one.name, one.joints, one.tip) == (same.name, same.joints, same.tip)
    with pytest.raises(am.ModelError, match=r'none\.srdf'):
        am.RobotModel.from_files(files.urdf, tmp_path / 'none.srdf', files.limits)
