# SPDX-FileCopyrightText: 2026 The arm and quad developers
# SPDX-License-Identifier: Apache-2.0
"""The first motion of a joint on the page: a bus.yml that is wrong about drives on a real bus."""

from __future__ import annotations

from collections.abc import Callable
import math
from pathlib import Path
import time
from typing import TYPE_CHECKING

import browser as chromium
from processes import executable, RunningProcess
import pytest
import yaml

from arm_canopen import DriveState, load_bus
from canopen_sim import DeviceRunner, simulated_devices
from canopen_tools.cli.main import main as canopen
from first_motion import JointKind
from robot_viewer.nodes.first_motion import HOLD, PRESS_ANEW
from robot_viewer.page.first_motion import Saw
from robot_viewer.robot_state import ALLOW

if TYPE_CHECKING:
    from isolation import Isolation
    from playwright.sync_api import Page

pytestmark = [
    pytest.mark.scenario,
    pytest.mark.timeout(300),
    pytest.mark.skipif(bool(chromium.lacking()), reason=chromium.lacking()),
]

DRIVE = Path(__file__).parents[1] / 'arm_canopen' / 'eds' / 'cia402_drive.eds'
PER_TURN = 36_000  # [inc] of the joints, in truth
STARTING = 60.0  # [s]
REACTION = 20.0  # [s] on a busy machine
REST = 0.5  # [s] without a motion
TITLE, PREPARE = 'First motion', 'Enable and prepare'
ARM = """
<robot name="arm">
  <link name="base"/>
  <joint name="shoulder" type="revolute">
    <parent link="base"/> <child link="upper"/> <axis xyz="0 1 0"/>
    <limit lower="-1.5" upper="1.5" velocity="1.0" effort="50"/>
  </joint>
  <link name="upper"/>
  <joint name="elbow" type="revolute">
    <parent link="upper"/> <child link="lower"/> <origin xyz="0 0 0.4"/> <axis xyz="0 1 0"/>
    <limit lower="-2.0" upper="2.0" velocity="1.0" effort="30"/>
  </joint>
  <link name="lower"/>
</robot>
"""


class Joint:
    """The shoulder as it really is: what its motor does."""

    def __init__(self, runner: DeviceRunner) -> None:
        self._runner = runner

    @property
    def angle(self) -> float:
        """Where it is in [deg]."""
        drive = self._runner.host.device(2).drives[0]
        return self._runner.call(lambda: drive.position).result(REACTION) * 360.0 / PER_TURN

    @property
    def state(self) -> DriveState:
        """State of its drive."""
        drive = self._runner.host.device(2).drives[0]
        return self._runner.call(lambda: drive.state).result(REACTION)

    def wait(self, condition: Callable[[], bool], what: str) -> None:
        """Wait until something is so."""
        deadline = time.monotonic() + REACTION
        while not condition():
            assert time.monotonic() < deadline, what
            time.sleep(0.02)

    def move(self, page: Page) -> None:
        """Hold the button of the page until it has moved a little; it is held on."""
        start = self.angle
        chromium.hold(page, HOLD)

        def moved() -> bool:
            if page.get_by_text(PRESS_ANEW).is_visible():  # a busy machine
                page.mouse.up()
                page.get_by_text(PRESS_ANEW).wait_for(state='hidden')
                page.mouse.down()
            return abs(self.angle - start) > 0.3

        self.wait(moved, 'a motion')

    def wait_for_rest(self) -> None:
        """Wait until it has stood for a while."""
        last, since = self.angle, time.monotonic()

        def rests() -> bool:
            nonlocal last, since
            if (now := self.angle) != last:
                last, since = now, time.monotonic()
            return time.monotonic() - since > REST

        self.wait(rests, 'rest')


def write_bus(folder: Path, per_turn: float) -> Path:
    """Write a bus.yml of two joints, as a person does."""
    path = folder / 'bus.yml'
    joints = [f'{name}={DRIVE}@{node}' for node, name in ((2, 'shoulder'), (3, 'elbow'))]
    turns = [f'--turn={name}={per_turn}' for name in ('shoulder', 'elbow')]
    modes = [f'--mode={name}=8' for name in ('shoulder', 'elbow')]
    assert canopen(['new', *joints, *turns, *modes, '--output', str(path)]) == 0
    return path


def open_first_motion(page: Page) -> None:
    """Open its folder, which is folded in the beginning."""
    page.get_by_role('tab', name='Diagnose', exact=True).click(force=True)
    if not page.get_by_label('Distance [deg]').is_visible():
        page.get_by_text(TITLE, exact=True).click(force=True)
    page.get_by_label('Distance [deg]').wait_for()


def prepare(page: Page, distance: str) -> None:
    """Have a motion prepared, of another distance than the one before; nothing moves yet."""
    # forced: a busy machine draws too seldom for playwright to find out that something stands
    open_first_motion(page)
    page.get_by_label('Distance [deg]').fill(distance)
    page.get_by_label('Speed [deg/s]').fill('2')
    page.keyboard.press('Tab')  # the number counts when it is left
    chromium.press(page.get_by_role('button', name=PREPARE))
    moves = JointKind.TURNS.shown(math.radians(float(distance)))
    page.get_by_text(f'It will move {moves},').wait_for()


def test_a_wrong_sign_and_scale_are_found_on_the_page(
    isolation: Isolation, tmp_path: Path
) -> None:
    """Nothing moves for a page that has crashed, nor after STOP; its lines correct bus.yml."""
    truth, folder = tmp_path / 'truth', tmp_path / 'arm'
    simulated = write_bus(truth, PER_TURN)
    bus_yml = write_bus(folder, -PER_TURN / 4)
    (folder / 'arm.urdf').write_text(ARM)
    command = [executable('arm_bringup', 'bringup'), str(folder), '--can', isolation.bus]
    with (
        simulated_devices(simulated, bus=isolation.bus) as runner,
        RunningProcess([*command, '--enable'], isolation.env | {'NO_VIEW': ''}) as bringup,
        chromium.browser() as browser,
    ):
        url = chromium.url_of(bringup, STARTING)
        bringup.wait_for('are enabled', STARTING)
        joint = Joint(runner)

        page = chromium.open_page(browser, url)
        prepare(page, '20')
        assert joint.angle == 0.0
        joint.move(page)
        page.mouse.up()
        joint.wait_for_rest()
        page.get_by_text('at rest').wait_for()
        chromium.press(page.get_by_role('button', name='That is enough'))
        page.get_by_text('ended by you before the target').wait_for()
        chromium.choose(page, 'What you saw', Saw.OTHER_WAY.value)
        page.get_by_label('How far [deg]').fill(f'{abs(joint.angle):.2f}')
        page.keyboard.press('Tab')
        chromium.press(page.get_by_role('button', name='Conclude'))
        page.get_by_text('wrong sign and wrong scale').wait_for()
        page.get_by_text('encoder lines in the place of their four edges').first.wait_for()
        lines = page.locator('pre').filter(has_text='scale_pos_to_dev: 5729.57795131').first
        lines.wait_for()  # the parts of a line have colours of their own
        chromium.picture(page, 'first-motion')
        written = yaml.safe_load(bus_yml.read_text())
        written['nodes']['shoulder'] |= yaml.safe_load(lines.inner_text())
        bus_yml.write_text(yaml.safe_dump(written, sort_keys=False))
        shoulder, elbow = (node.drive for node in load_bus(bus_yml).nodes)
        assert shoulder.scale_pos_to_dev == pytest.approx(PER_TURN / math.tau)
        assert elbow.scale_pos_to_dev == pytest.approx(-PER_TURN / 4 / math.tau)

        prepare(page, '-20')
        page.get_by_text('at rest').wait_for()
        chromium.picture(page, 'first-motion-ready')
        joint.move(page)
        page.keyboard.press('Space')
        joint.wait_for_rest()
        page.get_by_text('ended by a stop; prepare it anew').wait_for()
        assert joint.state is DriveState.OPERATION_ENABLED, 'it holds'
        page.mouse.up()

        chromium.act(page, ALLOW)
        prepare(page, '20')
        stood = joint.angle
        joint.move(page)
        chromium.crash(page)
        joint.wait_for_rest()
        assert abs(joint.angle - stood) < 4.0, '20 deg of the wrong scale are 5'
