# SPDX-FileCopyrightText: 2026 The arm and quad developers
# SPDX-License-Identifier: Apache-2.0
"""Laws of the planning scene: objects, attached bodies, what may touch; nothing ever changes."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import astuple
from itertools import product
import math

from hypothesis import given, settings
from hypothesis import strategies as st
from model_robots import chain, gripper, robot, ROBOTS, two_arms, two_arms_texts
import numpy as np
import pinocchio as pin
import pytest

import arm_model as am

STEP = 1e-6
LENGTHS = st.floats(0.02, 0.2)
SHAPES = st.one_of(
    st.builds(am.Box, LENGTHS, LENGTHS, LENGTHS),
    st.builds(am.Sphere, LENGTHS),
    st.builds(am.Cylinder, LENGTHS, LENGTHS),
    st.builds(am.Capsule, LENGTHS, LENGTHS),
    st.builds(am.Cone, LENGTHS, LENGTHS),
    st.builds(lambda a, b: am.Mesh(list(product((-a, a), (-b, b), (-a, b)))), LENGTHS, LENGTHS),
)
POSES = st.builds(
    lambda numbers: am.Pose(pin.exp3(np.array(numbers[3:])), np.array(numbers[:3])),
    st.tuples(*[st.floats(-0.8, 0.8)] * 3, *[st.floats(-1.5, 1.5)] * 3),
)
POSITIONS = st.tuples(*[st.floats(-1.9, 1.9)] * 4).map(np.array)

MODEL = chain('zyyp')
TABLE = am.CollisionObject('table', am.Plane(offset=-0.1))
AWAY = am.Pose(np.eye(3), np.array([3.0, 0.0, 0.5]))
CUP = am.CollisionObject('cup', am.Cylinder(0.04, 0.1), am.Sphere(0.05))


def distances(scene: am.PlanningScene, positions: am.Array) -> dict[tuple[str, str, int], float]:
    """Return the distance of each pair of shapes."""
    least = am.Clearances(scene).least(positions, math.inf).tolist()
    pairs = list(scene.pairs)
    return {
        (*pair, pairs[:number].count(pair)): least[number] for number, pair in enumerate(pairs)
    }


Change = Callable[[am.PlanningScene], am.PlanningScene]
CHANGES: dict[str, Change] = {
    'with_object': lambda scene: scene.with_object(
        am.CollisionObject('new', am.Box(0.1, 0.1, 0.1))
    ),
    'replace': lambda scene: scene.with_object(am.CollisionObject('cup', am.Sphere(0.2))),
    'without': lambda scene: scene.without('cup'),
    'attached': lambda scene: scene.attached('cup', 'link_4', np.zeros(4), ['link_3']),
    'detached': lambda scene: scene.detached('tool', np.zeros(4)),
    'allowing': lambda scene: scene.allowing('link_*', 'cup'),
    'with_allowed': lambda scene: scene.with_allowed(am.AllowedCollisionMatrix()),
}


@pytest.mark.parametrize('change', CHANGES.values(), ids=CHANGES.keys())
def test_a_scene_never_changes(change: Change) -> None:
    """What is made of it is another one; its tables and arrays refuse to be written."""
    tool = am.AttachedBody(am.CollisionObject('tool', am.Box(0.1, 0.1, 0.1)), 'link_4')
    scene = MODEL.scene.with_object(TABLE).with_object(CUP).with_attached(tool)
    at = np.array([0.1, 0.2, 0.3, 0.0])

    def content() -> tuple[object, ...]:
        things = dict(scene.objects), dict(scene.attached_bodies)
        return *things, scene.allowed, scene.pairs, distances(scene, at)

    before = content()
    assert change(scene) is not scene
    assert content() == before
    for table in (scene.objects, scene.attached_bodies, scene.allowed.entries):
        with pytest.raises(TypeError):
            table['x'] = None  # type: ignore[index]
    for array in (scene.distance_rate_bounds, scene.relative_motion_sign):
        with pytest.raises(ValueError, match='read-only'):
            array[0, 0] = 1.0


@settings(max_examples=30, deadline=None)
@given(SHAPES, POSES, POSITIONS)
def test_an_object_that_goes_again_leaves_nothing(
    shape: am.Shape, pose: am.Pose, at: am.Array
) -> None:
    """Without it there is the arm alone."""
    scene = MODEL.scene.with_object(am.CollisionObject('thing', shape, pose=pose))
    assert {pair for pair in scene.pairs if 'thing' in pair}
    assert distances(scene.without('thing'), at) == distances(MODEL.scene, at)


@settings(max_examples=30, deadline=None)
@given(SHAPES, POSES, POSITIONS, POSITIONS)
def test_attached_bodies_move_with_their_link(
    shape: am.Shape, pose: am.Pose, at: am.Array, later: am.Array
) -> None:
    """Taken up and laid down at one place, nothing has moved; elsewhere it came along."""
    scene = MODEL.scene.with_object(am.CollisionObject('thing', shape, pose=pose))
    carried = scene.attached('thing', 'link_3', at)
    assert not carried.objects
    back = carried.detached('thing', at)
    assert not back.attached_bodies
    assert back.objects['thing'].pose.position == pytest.approx(pose.position, abs=1e-9)
    assert back.objects['thing'].pose.rotation == pytest.approx(pose.rotation, abs=1e-9)
    assert distances(back, at) == pytest.approx(distances(scene, at), abs=1e-4)
    moved = carried.detached('thing', later).attached('thing', 'link_3', later)
    in_link = carried.attached_bodies['thing'].object.pose
    assert moved.attached_bodies['thing'].object.pose.position == pytest.approx(in_link.position)
    assert carried.pose('thing', later).position == pytest.approx(
        carried.detached('thing', later).objects['thing'].pose.position
    )


@settings(max_examples=40, deadline=None)
@given(SHAPES, SHAPES, POSES, POSES, POSITIONS)
def test_distances_are_symmetric(
    one: am.Shape, other: am.Shape, one_pose: am.Pose, other_pose: am.Pose, at: am.Array
) -> None:
    """Whichever of two things stands still, and whichever is carried."""
    scene = MODEL.scene.with_object(am.CollisionObject('one', one, pose=one_pose))
    scene, found = scene.with_object(am.CollisionObject('other', other, pose=other_pose)), []
    for name in ('one', 'other'):
        measured = distances(scene.attached(name, 'link_4', at), at)
        found.append(next(measured[each] for each in measured if {*each} >= {'one', 'other'}))
    # of shapes deep in each other, two ways out may be found
    if min(found) > 0.0:
        assert found[0] == pytest.approx(found[1], abs=2e-4)
    assert (found[0] < -1e-3) == (found[1] < -1e-3) or max(found) < 1e-3


MODELS = {'chain': MODEL, **{name: robot(name) for name in ROBOTS}}
MODELS |= {'two arms': two_arms(), 'gripper': gripper()}
CELLS = st.lists(st.tuples(*[st.integers(-20, 20)] * 3), min_size=1, max_size=30, unique=True)


@pytest.mark.parametrize('model', MODELS.values(), ids=MODELS)
@settings(max_examples=25, deadline=None)
@given(
    st.one_of(SHAPES, CELLS.map(lambda cells: am.Cells(0.05 * (np.array(cells) + 0.5), 0.05))),
    POSES,
    st.lists(st.floats(-1.9, 1.9), min_size=9, max_size=9),
    st.booleans(),
)
def test_gradients_of_distances_are_differences(
    model: am.RobotModel, shape: am.Shape, pose: am.Pose, places: list[float], carried: bool
) -> None:
    """Between links, to objects that stand still or are carried, to a table and to an octomap.

    They are at most the bounds of their rates.
    """
    at = np.clip(np.array(places[: len(model)]), model.limits.lower, model.limits.upper)
    scene = model.scene.with_object(TABLE).with_object(am.CollisionObject('it', shape, pose=pose))
    carrier = list(model.scene.link_shapes)[-1]
    scene = scene.attached('it', carrier, at) if carried else scene

    def measured(positions: am.Array) -> am.Array:
        every = am.Clearances(scene).nearest(positions, math.inf, len(scene.pairs))
        return np.array([each.distance for each in sorted(every, key=lambda each: each.pair)])

    step, here = 1e-3, am.Clearances(scene).nearest(at, math.inf, len(scene.pairs))
    ahead, behind = (
        np.array([measured(at + sign * step * unit) for unit in np.eye(len(at))])
        for sign in (1.0, -1.0)
    )
    for near in here:
        assert (np.abs(near.gradient) <= scene.distance_rate_bounds[near.pair] + 1e-9).all()
        apart = near.distance if {'it', 'table'} & {*near.links} else abs(near.distance)
        if apart < 0.01:
            continue  # the normal turns about at the touch
        difference = ahead[:, near.pair] - behind[:, near.pair]
        bend = np.abs(ahead[:, near.pair] + behind[:, near.pair] - 2 * near.distance)
        smooth = bend < 0.02 * step  # deep in contact, two ways out may be equally short
        assert near.gradient[smooth] == pytest.approx(difference[smooth] / (2 * step), abs=0.02)


def test_contacts_are_named_with_their_place_and_depth() -> None:
    """The deepest first; the normal leads from the first body to the second."""
    middle = am.Pose(np.eye(3), np.array([0.0, 0.0, 0.5]))
    scene = MODEL.scene.with_object(am.CollisionObject('wall', am.Box(0.3, 1.0, 1.0), pose=middle))
    contacts = am.Clearances(scene).contacts(np.zeros(4))
    assert contacts
    assert [each.depth for each in contacts] == sorted((e.depth for e in contacts), reverse=True)
    for each in contacts:
        assert each.bodies[1] == 'wall'
        assert each.depth > 0.0
        assert np.linalg.norm(each.normal) == pytest.approx(1.0)
    allowed = am.Clearances(scene.allowing('link_?', 'wall'))
    assert not allowed.contacts(np.zeros(4))
    assert len(allowed.pairs) == len(MODEL.pairs)


def test_touch_links_may_be_touched_and_no_others() -> None:
    """The link that carries, always; two things in one hand, too."""
    thing, other = (am.CollisionObject(name, am.Sphere(0.1)) for name in ('thing', 'other'))
    held = MODEL.scene.with_attached(am.AttachedBody(thing, 'link_4'))
    checked = {pair[0] for pair in held.pairs if 'thing' in pair}
    assert checked == {'link_1', 'link_2', 'link_3'}
    held = MODEL.scene.with_attached(am.AttachedBody(thing, 'link_4', frozenset({'link_3'})))
    assert ('link_3', 'thing') not in held.pairs
    for link, is_checked in (('link_4', False), ('link_1', True)):
        pairs = held.with_attached(am.AttachedBody(other, link)).pairs
        assert (('thing', 'other') in pairs) is is_checked


NAMES = ('link_1', 'link_2', 'cup')


@given(
    st.dictionaries(st.sampled_from([frozenset(p) for p in product(NAMES, NAMES)]), st.booleans()),
    st.dictionaries(st.sampled_from(NAMES), st.booleans()),
)
def test_what_may_touch_follows_the_rules_of_moveit(
    entries: dict[frozenset[str], bool], defaults: dict[str, bool]
) -> None:
    """The entry of the pair, else its defaults, which both must allow; else it is checked."""
    matrix = am.AllowedCollisionMatrix(entries, defaults)
    for first, second in product(NAMES, NAMES):
        pair, known = frozenset((first, second)), [defaults.get(first), defaults.get(second)]
        given_defaults = [each for each in known if each is not None]
        wanted = entries.get(pair, bool(given_defaults) and all(given_defaults))
        assert matrix.allows(first, second) is matrix.allows(second, first) is wanted
        assert matrix.with_entries([pair], True).allows(second, first)
    assert not matrix.without('cup').allows('cup', 'cup')
    assert am.AllowedCollisionMatrix(defaults={'new': True}).allows('new', 'newer')


HELD = am.AttachedBody(CUP, 'link_4', frozenset({'finger'}))
ODD = am.CollisionObject('link_1', am.Sphere(0.1))


@pytest.mark.parametrize(
    ('refused', 'words'),
    [
        (lambda scene: scene.without('glass'), "no object 'glass'; objects: cup"),
        (lambda scene: scene.detached('cup', np.zeros(4)), "no attached body 'cup'"),
        (lambda scene: scene.attached('cup', 'hand', np.zeros(4)), "no link 'hand'"),
        (lambda scene: scene.attached('glass', 'link_4', np.zeros(4)), "no object 'glass'"),
        (lambda scene: scene.allowing('hand_*', 'cup'), "no link or object 'hand_"),
        (lambda scene: scene.with_object(ODD), 'a link has this name'),
        (
            lambda scene: scene.with_attached(am.AttachedBody(CUP, 'link_4')),
            'and attached to link_4',
        ),
        (lambda scene: scene.without('cup').with_attached(HELD), "no link 'finger'"),
        (lambda scene: scene.with_contents(padding={'link_1': -0.1}), 'link_1: padding -0.1'),
        (lambda scene: scene.with_contents(padding={'link_1': math.nan}), 'link_1: padding nan'),
        (lambda scene: scene.with_contents(scale={'link_1': 0.0}), 'scale 0: .* positive'),
        (lambda scene: scene.with_contents(scale={'link_1': math.inf}), 'finite'),
        (lambda scene: scene.with_contents(padding={'hand': 0.1}), "no link 'hand'"),
        (lambda _: am.CollisionObject('', am.Sphere(0.1)), 'needs a name'),
        (lambda _: am.CollisionObject('x', am.Box(0.1, -0.1, 0.1)), 'must be positive'),
        (lambda _: am.CollisionObject('x', am.Sphere(math.nan)), 'must be positive'),
        (lambda _: am.CollisionObject('x', am.Plane((0.0, 0.0, 0.0))), 'no direction'),
        (lambda _: am.Mesh([[0.0, 0.0]]), 'points of three numbers'),
        (lambda _: am.Mesh([[0.0, 0.0, math.inf]]), 'finite'),
    ],
)
def test_what_does_not_fit_is_refused(
    refused: Callable[[am.PlanningScene], object], words: str
) -> None:
    """With the name, and the names that there are."""
    with pytest.raises(am.SceneError, match=words):
        refused(MODEL.scene.with_object(CUP))


def test_an_object_of_several_shapes_is_one_thing() -> None:
    """Each shape is where its pose says; links are paired with all of them."""
    raised = am.PlacedShape(am.Sphere(0.1), am.Pose(np.eye(3), np.array([0.0, 0.0, 3.0])))
    scene = MODEL.scene.with_object(am.CollisionObject('lamp', am.Sphere(0.1), raised))
    near, far = (distances(scene, np.zeros(4))['link_1', 'lamp', number] for number in (0, 1))
    assert far - near > 2.0


def test_joints_beside_the_group_that_count_where_they_are_not_are_named() -> None:
    """Those between links that are checked, at 0 or at the limit next to it."""
    left = two_arms('left')
    assert any('right_2_link' in pair for pair in left.pairs)
    assert 'torso at 0, right_1 at 0, right_2 at 0,' in left.assumption()
    assert 'torso at 0, right_2 at 0,' in left.assumption({'right_1'})
    assert left.assumption({'torso', 'right_1', 'right_2'}) == ''
    assert two_arms('both').assumption() == ''
    urdf, srdf, limits = two_arms_texts()
    raised = am.RobotModel(urdf.replace('lower="-1.5"', 'lower="0.2"'), srdf, limits, 'left')
    assert 'torso at 0.2,' in raised.assumption()


def test_arms_that_move_by_themselves_are_left_to_a_scene() -> None:
    """No position of the other is assumed; a scene between both has what both may bring."""
    sides = {side: two_arms(side).joints for side in ('left', 'right')}
    for group, other in (('left', 'right'), ('right', 'left')):
        model = am.RobotModel(*two_arms_texts(), group, moved_by_others={other: sides[other]})
        assert not any(f'{other}_1_link' in pair for pair in model.pairs)
        assert f'{other}_1' not in model.assumption()
        assert all(f'{other}_' in ' '.join(pair) for pair in model.moved_by_others[other])
        floor = am.CollisionObject('floor', am.Plane(offset=0.2))
        whole = model.scene.with_allowed(model.allowed).with_object(floor)
        between = whole.between(list(sides.values()))
        assert set(between.kinematics.joints) == {*sides['left'], *sides['right']}
        assert between.pairs
        for pair in between.pairs:
            assert {name.split('_')[0] for name in pair} == {'left', 'right'}


def test_a_model_measures_in_the_scene_that_it_is_given() -> None:
    """From then on an object counts in all its answers."""
    model, at = two_arms('right', 'torso_link'), np.zeros(2)
    alone = model.clearance(at)
    floor = am.CollisionObject('floor', am.Plane(offset=0.2))
    clearances = am.Clearances(model.scene.with_object(floor))
    model.use_scene(clearances)
    assert model.scene is clearances.scene
    assert model.clearance(at) < alone
    for _ in range(2):
        assert 'floor' in model.nearest(at, math.inf, 1)[0].links
    with pytest.raises(am.SceneError, match='not that of right'):
        model.use_scene(am.Clearances(MODEL.scene))


def test_a_mimic_joint_follows() -> None:
    """In poses and Jacobians; in distances and their gradients above."""
    model, at = gripper(), np.array([0.3, 0.02])
    assert (model.joints, model.tip) == (('j1', 'finger'), 'right_link')
    pose, jacobian = model.pose(at), model.jacobian(at)
    for number, unit in enumerate(np.eye(2)):
        moved = (model.pose(at + STEP * unit).position - pose.position) / STEP
        assert jacobian[:3, number] == pytest.approx(moved, abs=1e-5)
    y = model.pose(at, 'right_link').position - model.pose(at, 'left_link').position
    assert np.linalg.norm(y) == pytest.approx(0.02 + 2.0 * 0.02 + 0.01)


@settings(max_examples=40, deadline=None)
@given(SHAPES, POSES, st.floats(0.0, 0.1), st.floats(0.5, 2.0))
def test_padding_is_the_same_in_every_direction_and_for_the_world_only(
    shape: am.Shape, pose: am.Pose, padding: float, scale: float
) -> None:
    """A link, and what it carries, is nearer to objects by exactly the padding, whatever it is."""
    thing, mark = (
        am.CollisionObject('thing', shape),
        am.CollisionObject('mark', am.Sphere(0.01), pose=AWAY),
    )
    at = np.array([0.3, -0.4, 0.2, 0.1])
    scene = MODEL.scene.with_object(mark).with_attached(am.AttachedBody(thing.at(pose), 'link_4'))
    bare = distances(scene, at)
    thick = distances(scene.with_contents(padding={'link_4': padding}), at)
    assert thick.keys() == bare.keys()
    for pair, distance in bare.items():
        nearer = padding if 'mark' in pair and {'link_4', 'thing'} & {*pair} else 0.0
        assert thick[pair] == pytest.approx(distance - nearer, abs=1e-5), pair
    if isinstance(shape, am.Mesh):
        middle = shape.points.mean(axis=0)
        large: am.Shape = am.Mesh(middle + scale * (shape.points - middle))
    else:
        assert not isinstance(shape, am.Plane | am.Cells)
        large = type(shape)(*(scale * length for length in astuple(shape)))
    scaled = am.CollisionObject('thing', large, pose=pose)
    larger = scene.with_contents(scale={'link_4': scale})
    by_hand = MODEL.scene.with_object(mark).with_attached(am.AttachedBody(scaled, 'link_4'))
    name = next(pair for pair in bare if {'mark', 'thing'} <= {*pair})
    assert distances(larger, at)[name] == pytest.approx(distances(by_hand, at)[name], abs=1e-5)


def test_scenes_are_the_same_by_what_is_in_them() -> None:
    """Things that are made anew count as the same; a place, a shape or an allowance do not."""

    def scene(x: float = 0.5, size: float = 0.1, held: float = 0.2) -> am.PlanningScene:
        box = am.CollisionObject(
            'box', am.Box(size, size, size), pose=am.Pose(np.eye(3), np.full(3, x))
        )
        cup = am.CollisionObject(
            'held', am.PlacedShape(am.Sphere(0.02), am.Pose(np.eye(3), np.full(3, held)))
        )
        return MODEL.scene.with_object(box).with_attached(am.AttachedBody(cup, 'link_4'))

    left = two_arms('left')
    assert scene().is_same(scene(x=0.5 + 1e-12))
    for other in (
        scene(x=0.5001),
        scene(size=0.1001),
        scene(held=0.2001),
        scene().without('box'),
        scene().without('held'),
        scene().with_object(CUP),
        scene().allowing('box', 'link_4'),
        scene().with_contents(padding={'link_4': 0.01}),
        scene().with_contents(scale={'link_4': 1.1}),
        left.scene,
    ):
        assert not scene().is_same(other)
        assert not other.is_same(scene())
    assert not left.scene.is_same(left.with_others({'torso': 0.1}).scene)
