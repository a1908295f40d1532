# SPDX-FileCopyrightText: 2026 The arm and quad developers
# SPDX-License-Identifier: Apache-2.0
"""The demo of planning judges by what is seen, not by what is reported."""

from __future__ import annotations

from functools import cache
from pathlib import Path

from demo_doubles import FakeDisplay, FakeSupervisor
import pytest
from simulated_planning import Misbehaviour, SimulatedPlanning

from arm_bringup.demos.plan.observer import Observer
from arm_bringup.demos.plan.scenario import PlanScenario
from arm_bringup.demos.plan.sequence import Arm, PlanSequence
from arm_bringup.demos.plan.tool import flange_tool
from arm_bringup.demos.plan.workcell import find_workcell
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
    scenario = PlanScenario(
        FakeDisplay(),
        arm.model.joints,
        'cyclic_position_mode',
        lambda client_, results: PlanSequence(client_, [arm], results, clock=client.clock),
        duration=0.0,
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
