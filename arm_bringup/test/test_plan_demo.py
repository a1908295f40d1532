# SPDX-FileCopyrightText: 2026 The arm and quad developers
# SPDX-License-Identifier: Apache-2.0
"""The demo of planning judges by what is seen, not by what is reported."""

from __future__ import annotations

from functools import cache
from pathlib import Path

from demo_doubles import FakeDisplay, FakeSupervisor
import pytest
from simulated_planning import Misbehaviour, SimulatedPlanning

from arm_bringup.demos.plan.motions import Motions
from arm_bringup.demos.plan.observer import Observer
from arm_bringup.demos.plan.orders import MotionOrder
from arm_bringup.demos.plan.results import PlanResults
from arm_bringup.demos.plan.sequence import Arm, PlanSequence
from arm_bringup.demos.plan.tool import flange_tool
from arm_bringup.demos.plan.workcell import by_joint, find_workcell
from arm_bringup.demos.scenario import PartsScenario
from arm_bringup.description import expand_xacro
from arm_model import load_limits, RobotModel, start_pose
from demo_runner import DemoResult

pytestmark = pytest.mark.slow

FOLDER = Path(__file__).parents[1] / 'robots' / 'gp110'


@cache
def played_arm() -> tuple[str, Arm]:
    """Return the description of the GP110, and the arm with its workcell."""
    urdf = expand_xacro(FOLDER / 'gp110.urdf.xacro')
    semantic = (FOLDER / 'gp110.srdf').read_text()
    model = RobotModel(urdf, semantic, load_limits(FOLDER / 'limits.yaml'))
    tool = flange_tool(model, start_pose(model))
    return urdf, Arm(model, tool, find_workcell(model, tool))


def played(wrong: Misbehaviour) -> DemoResult:
    """Run the demo on a robot that misbehaves; return how it judges."""
    urdf, arm = played_arm()
    assert arm.cell is not None
    observer = Observer(urdf, arm.model)
    client = SimulatedPlanning(observer, arm.model, arm.cell.home, wrong)
    scenario = PartsScenario[SimulatedPlanning](
        FakeDisplay(),
        arm.model.joints,
        'cyclic_position_mode',
        0.0,
        lambda _, enter, look: PlanSequence(
            [arm], enter, Motions(client, PlanResults(), look, client.clock)
        ),
    )
    scenario.run(FakeSupervisor(), lambda _given_up: client)
    return scenario.result


def test_all_goes_well_on_a_robot_that_does_as_it_should() -> None:
    """Every part has its row."""
    result = played(Misbehaviour())
    assert result.problems == []
    rows = dict(line.split('  ', 1) for line in result.summary)
    assert list(rows) == [
        *('pick', 'place', 'box in the way', 'blocked goal', 'viewer', 'planning'),
        'bus and loop',
    ]
    assert 'GOAL_IN_COLLISION' in rows['blocked goal']
    assert 'pillar' in rows['blocked goal']
    assert '(2 plans)' in rows['box in the way']


def test_ctrl_c_cancels_all_motions_that_are_on_their_way() -> None:
    """Those of two arms at the same time, too; one that has ended is left alone."""
    urdf, arm = played_arm()
    assert arm.cell is not None
    client = SimulatedPlanning(Observer(urdf, arm.model), arm.model, arm.cell.home, Misbehaviour())
    motions = Motions(client, PlanResults(), lambda: None, client.clock)
    orders = [
        MotionOrder(arm.model.group, by_joint(arm.model, pose))
        for pose in (arm.cell.home, arm.cell.aside, arm.cell.aside)
    ]
    ended = motions.attempt(orders[0])
    under_way = [motions.send(order) for order in orders[1:]]
    assert [run.done for run in under_way] == [False, False]
    motions.cancel()
    assert [run.end().code for run in (ended, *under_way)] == ['SUCCESS', *['PREEMPTED'] * 2]


def test_the_demo_waits_until_move_group_knows_where_the_joints_are() -> None:
    """DDS may take its time; not for ever."""
    assert played(Misbehaviour(stale=3)).problems == []
    (problem,) = played(Misbehaviour(stale=1000)).problems
    assert 'ROBOT_STATE_STALE' in problem


def test_a_box_that_does_not_stop_the_arm_fails_the_demo() -> None:
    """The contact is measured at the joint states, whatever move_group says."""
    problems = played(Misbehaviour(unseen='visitor')).problems
    assert any('touched visitor' in each or 'visitor touched' in each for each in problems)
    assert any('planned 1 times' in each for each in problems)


@pytest.mark.parametrize(
    ('wrong', 'words'),
    [
        (Misbehaviour(unseen='pillar'), 'pillar'),
        (Misbehaviour(is_silent=True), 'the message names none of'),
        (Misbehaviour(accepts_blocked=True), 'SUCCESS instead of GOAL_IN_COLLISION'),
        (Misbehaviour(short=0.02), 'from its goal'),
        (Misbehaviour(is_blind=True), 'nobody saw'),
        (Misbehaviour(no_display=True), 'display_planned_path'),
        (Misbehaviour(old_scene=True), 'the robot in monitored_planning_scene'),
    ],
    ids=str,
)
def test_what_goes_wrong_fails_the_demo(wrong: Misbehaviour, words: str) -> None:
    """Each by its own fact."""
    assert any(words in each for each in played(wrong).problems)
