# SPDX-FileCopyrightText: 2026 The arm and quad developers
# SPDX-License-Identifier: Apache-2.0
"""The page of a robot: STOP and state, then groups Drive, Plan or Body, See and Diagnose."""

from __future__ import annotations

from collections.abc import Callable, Iterator, Mapping, Sequence
from concurrent.futures import Future
from contextlib import contextmanager, redirect_stdout
from functools import partial
from html import escape
import io
import math
import time
from typing import Any, Protocol, TypedDict

from urdf_reader import KinematicTree, Transform
from viser import (
    CameraHandle,
    GuiButtonHandle,
    GuiDropdownHandle,
    GuiHtmlHandle,
    GuiTabGroupHandle,
    GuiTabHandle,
    Icon,
    InitialCameraConfig,
    ViserServer,
)

from ..robot_state import BUS, drives_of, FOLLOWS, Level, RobotState, Status, Stop
from .gate import Gate, shown_host
from .jog_panel import Actions, History, JogPanel, joint_texts, Offered, PlotPanel, Velocity
from .live import Hold, Live, RELEASED_AFTER
from .robot_scene import feet_of, Ground, RobotScene
from .style import (
    add_button,
    add_choice,
    add_speed,
    BAD,
    CAUTION,
    drive_html,
    GOOD,
    Log,
    NEUTRAL,
    pad,
    PRESENT,
    sentence,
    status_line,
    THREE_COLUMNS,
    WANTED,
    WARNING,
)

ARM_SPEED, LEGS_SPEED = 20.0, 30.0  # initial speeds in [%]
PANEL_WIDTH = 400  # in [px]
WALKS: Mapping[str, tuple[str, Velocity]] = {
    'Turn left': ('j', (0.0, 0.0, 1.5)),
    'Forward': ('i', (0.3, 0.0, 0.0)),
    'Turn right': ('l', (0.0, 0.0, -1.5)),
    'Left': ('J', (0.0, 0.15, 0.0)),
    'Back': (',', (-0.3, 0.0, 0.0)),
    'Right': ('L', (0.0, -0.15, 0.0)),
    'Forward to the left': ('u', (0.3, 0.0, 1.5)),
    'Forward to the right': ('o', (0.3, 0.0, -1.5)),
    'Back to the left': ('m', (-0.3, 0.0, -1.5)),
    'Back to the right': ('.', (-0.3, 0.0, 1.5)),
}
"""Keys of teleop_keyboard, and full-speed velocities: forward and left in [m/s], yaw rate in
[rad/s]. The last four have no button."""
WALK_BUTTONS = 6
MODES: Mapping[str, str] = {
    'Stand': 'stand',
    'Walk': 'walk',
    'Lie down': 'lie',
    'Turn': 'turn',
    'Relax': 'relax',
    'Get up': 'get_up',
    'Follow policy': 'policy',
}
"""Modes of a walking robot by button label."""
IN_FAULT = frozenset({'lie', 'relax', 'get_up'})  # modes that are permitted in a fault
GAITS = ('trot', 'crawl', 'pace')
DRIVE_GROUPS: Mapping[str, Mapping[str, str]] = {
    '': {'Enable': 'enable', 'Recover': 'recover', 'Halt': 'halt'},
    'Seldom needed': {
        'Initialise': 'init',
        'Home': 'home',
        'Quick stop': 'quick_stop',
        'Cyclic position mode': 'cyclic_position_mode',
        'Interpolated position mode': 'interpolated_position_mode',
        'Position mode': 'position_mode',
        'Velocity mode': 'velocity_mode',
    },
}
"""Drive services by group title and label; groups with a title are folded."""
DISABLE, SINKS = 'disable', 'Disable: no torque, the arm may sink (hold 1 s)'
DISABLE_AFTER = 1.0  # time in [s] to hold the button
MOTIONS = frozenset({'home', 'init'})  # drive services that may move the drive
BUTTON_COLORS = {'enable': WANTED, 'home': CAUTION, 'quick_stop': CAUTION, 'relax': CAUTION}
NO_DRIVE, ALL_DRIVES = 'none chosen', 'all drives'
WORST = (2, 3, 1, 0)  # levels of a status, the worst first
VIEWS: Mapping[str, tuple[str, Velocity]] = {
    'Fit': ('F', (0.52, -0.52, 0.46)),
    'Front': ('X', (0.9, 0.0, 0.16)),
    'Side': ('Y', (0.0, -0.9, 0.16)),
    'Top': ('T', (0.001, 0.0, 1.05)),
}
"""Hotkey and camera position of each view, the position relative to the robot's size."""
STATUS_BOX = 'margin:0 12px 0.5em 2.2em;height:2.5em;line-height:1.25em;overflow:auto'
"""Style of status texts, of fixed height so that buttons below do not move."""
KEYS_MOVE = (
    '<div class="rv-speed"><span></span>'
    '<label><input type="checkbox" tabindex="-1">Keys move the robot (? lists them)</label></div>'
)
"""Speed text, and a checkbox that is local to each page."""
COPY_LOG = '<button class="rv-copy">Copy log</button>'
GROUPS = {
    'Drive': (Icon.DEVICE_GAMEPAD_2, 'No robot is here yet.'),
    'Plan': (Icon.ROUTE, 'Start the bring-up with --plan.'),
    'Body': (Icon.ROTATE_360, 'Nothing is known of the body yet.'),
    'See': (Icon.EYE, ''),
    'Diagnose': (Icon.STETHOSCOPE, ''),
}
"""Icon and placeholder text of each group."""


class Overlay(TypedDict):
    """Values that only the overlay shows."""

    stop: str  # stage of the active STOP: braking, stopped, failed, or empty
    simulated: bool
    program: str  # program that moves the robot; empty for none
    listens: str  # text on where the page searches for robots
    namespace: str  # of the robot; empty for none


class Panel(Protocol):
    """Content of a group, for one robot."""

    def remove(self) -> None:
        """Remove what does not disappear with the group."""


class RobotPage:
    """The page in a browser. One thread updates it; its actions come from any thread."""

    def __init__(self, host: str, port: int, actions: Actions) -> None:
        self._actions = actions
        self.live = Live(self._command)
        gate = Gate(host, self._stop, self.live)
        with gate.before(), redirect_stdout(io.StringIO()):  # viser draws its own banner
            self.server = ViserServer(host, port, label='robot', verbose=False)
        # with the token if one is required
        self.url = f'http://{shown_host(host)}:{self.server.get_port()}'
        if gate.token:
            self.url += f'/?token={gate.token}'
        self.robot: RobotScene | None = None
        gui = self.server.gui
        gui.configure_theme(show_logo=False, show_share_button=False, brand_color=WANTED)
        gui.main_panel.dock_right()
        gui.main_panel.set_width(PANEL_WIDTH)
        self.server.scene.set_up_direction('+z')
        self._ground = Ground(self.server.scene)
        for view, (key, _) in VIEWS.items():
            command = gui.add_command(f'View: {view}', hotkey=key, icon=Icon.CAMERA)  # type: ignore[arg-type]
            command.on_trigger(partial(self._look_from, view))
        self._set_camera('Fit', self.server.initial_camera)
        self._log = Log()
        self.last = ''  # the last message, with its time
        self._panels: dict[type, Panel] = {}
        self._tabs: GuiTabGroupHandle | None = None
        self._lay_out(('Drive', 'Plan', 'See', 'Diagnose'))

    def _lay_out(self, groups: Sequence[str]) -> None:
        """Rebuild the groups; their content must be offered again."""
        if self._tabs is not None:
            self._tabs.remove()
        self.live.clear()
        # tool or forward walking speed in [m/s] by speed fraction; None if unknown
        self.velocity: Callable[[float], float] | None = None
        self.cancel: Callable[[], object] = lambda: None  # discards the plan
        gui = self.server.gui
        self._tabs = gui.add_tab_group()
        self._groups: dict[str, GuiTabHandle] = {}
        self._notes: dict[str, GuiHtmlHandle] = {}
        for group in groups:
            icon, nothing = GROUPS[group]
            self._groups[group] = self._tabs.add_tab(group, icon)
            with self._groups[group]:
                self._notes[group] = gui.add_html(sentence(nothing))
        self._drives: dict[str, tuple[str, ...]] = {}
        self._jog: JogPanel | None = None
        self._plots: PlotPanel | None = None
        self._modes: dict[str, GuiButtonHandle] = {}
        self._disable: int | None = None
        self._walk_holds: dict[int, Velocity] = {}
        with self._groups['Drive']:
            # selected fraction of maximum velocity, above 0 to 1
            self.speed = add_speed(gui, ARM_SPEED if 'Plan' in groups else LEGS_SPEED)
            gui.add_html(KEYS_MOVE)
        with self._groups['See']:
            self._see = gui.add_folder(None)
        if 'Plan' in groups:
            self.offer_to_see('target', self._show_target)
        self.offer_to_see('frames', self._show_frames, seen=False)
        with self._groups['Diagnose']:
            self._statuses = gui.add_html('')
            self._drive_panel = gui.add_folder(None)
            self._drive: GuiDropdownHandle[str] | None = None
            self._drive_state: GuiHtmlHandle | None = None
            log = gui.add_folder('Log')
            self.before_log = log.order - 0.5  # order of a folder before the log
            with log:
                self._log_html = gui.add_html('')

    def offer_to_see(self, what: str, show: Callable[[bool], None], *, seen: bool = True) -> None:
        """Add a checkbox that shows or hides something in the scene, for this robot."""
        with self._groups['See']:
            box = self.server.gui.add_checkbox(f'Show {what}', seen, order=self._see.order - 0.5)
        box.on_update(lambda _: show(box.value))

    def _show_target(self, seen: bool) -> None:
        if self._jog is not None and self._jog.target is not None:
            self._jog.target.seen = seen

    def _show_frames(self, seen: bool) -> None:
        if self.robot is not None:
            self.robot.show_frames(seen=seen)

    @property
    def watched(self) -> bool:
        """Whether a page is open."""
        return self.live.open or bool(self.server.get_clients())

    def close(self) -> None:
        """Stop serving the page."""
        with redirect_stdout(io.StringIO()):
            self.server.stop()

    # -- what is shown

    def show_robot(self, tree: KinematicTree) -> list[str]:
        """Show another robot; return notes on what cannot be shown."""
        for panel in self._panels.values():
            panel.remove()
        self._panels = {}
        if self.robot is not None:
            self.robot.remove()
        second = 'Body' if feet_of(tree) else 'Plan'
        self._lay_out(('Drive', second, 'See', 'Diagnose'))
        self.robot = RobotScene(self.server.scene, tree)
        self._set_camera('Fit', self.server.initial_camera)
        for client in self.server.get_clients().values():
            self._set_camera('Fit', client.camera)
        if self.has('Plan'):
            ways = self._actions, self.live, self.speed
            place = partial(self.place, 'Drive')
            self._jog = JogPanel(self.server.gui, self.robot, ways, place)
        self.say(f'robot {tree.name}')
        return self.robot.notes

    def _look_from(self, view: str, event: Any) -> None:  # noqa: ANN401
        if event.client is not None:
            self._set_camera(view, event.client.camera)

    def _set_camera(self, view: str, camera: CameraHandle | InitialCameraConfig) -> None:
        reach = self.robot.size if self.robot is not None else 0.6
        size, height = min(reach + 0.4, max(1.2 * reach, 0.3)), 0.3 * reach
        x, y, z = VIEWS[view][1]
        camera.position = x * size, y * size, z * size + (height if view != 'Top' else 0.0)
        camera.look_at = 0.0, 0.0, height

    def show_base(self, pose: Transform) -> None:
        """Show the pose of the root link in the world, with the grid moving below it."""
        if self.robot is not None:
            self.robot.place_base(self._ground.pass_below(pose))

    def follow(self, positions: Mapping[str, float]) -> None:
        """Update the target for the present joint positions."""
        if self._jog is not None and self._jog.target is not None:
            self._jog.target.follow(positions)

    def end_target(self) -> None:
        """Ignore the rest of the press that moves to the target: the motion has ended."""
        if self._jog is not None and self._jog.target is not None:
            self.live.end(self._jog.target.hold)

    def show_state(self, state: RobotState, positions: Mapping[str, float], more: Overlay) -> None:
        """Show the state of the robot, and enable the controls that it permits."""
        self.live.movable = state.movable
        if self.robot is not None:
            self.robot.mark(state.faulty)
        faulty = state.level is Level.FAULT
        for mode, button in self._modes.items():
            able = state.movable or (faulty and mode in IN_FAULT)
            button.disabled = not able or self.live.stopped
        if self._jog is not None:
            self._jog.permit(state.movable and not self.live.stopped)
        tree, speed = None if self.robot is None else self.robot.tree, ''
        if self.velocity is not None:
            what = 'Forward' if self.has('Body') else 'Tool'
            speed = f'{what}: {1000.0 * self.velocity(self.speed()):.0f} mm/s'
        self.live.show(
            {
                'word': state.word,
                'level': state.level.value,
                'sentence': state.sentence,
                'action': state.action,
                'movable': state.movable,
                'robot': '' if tree is None else tree.name,
                'said': self.last,
                'speed': speed,
                'joints': {} if tree is None else joint_texts(tree, positions),
                **more,
            }
        )

    def show_mode(self, mode: str) -> None:
        """Show the mode of a walking robot, and which arrow buttons move it."""
        for name, button in self._modes.items():
            button.color = PRESENT if name == mode else BUTTON_COLORS.get(name, NEUTRAL)
        for number, (x, y, _) in self._walk_holds.items():
            self.live.off.pop(number, None)
            if mode not in FOLLOWS:
                self.live.off[number] = 'Press Walk first.'
            elif mode == 'turn' and (x or y):
                self.live.off[number] = 'Turn ignores forward and sideways. Press Walk first.'

    def show_statuses(self, statuses: Sequence[Status]) -> None:
        """Show all statuses, the worst first."""
        ordered = sorted(statuses, key=lambda status: (WORST.index(status.level), status.name))
        self._statuses.content = ''.join(
            f'{status_line(status.name, status.level)}'
            f'<div style="{STATUS_BOX}">{escape(status.message)}</div>'
            for status in ordered
        )
        if self._drive is None or self._drive_state is None:
            return
        buses = [status for status in statuses if status.name.endswith(BUS)]
        chosen = drives_of(statuses).get(self._drive.value.rpartition('/')[2])
        bus = buses[0].values if len(buses) == 1 else {}
        self._drive_state.content = (
            '' if chosen is None else drive_html(chosen.message, chosen.values, bus)
        )

    def plot(self, history: History, now: float) -> None:
        """Update the plots of the joints."""
        if self._plots is None and history.joints:
            with self._see:
                self._plots = PlotPanel(self.server.gui, history.joints)
        if self._plots is not None:
            self._plots.show(history, now)

    # -- what is offered

    def offer_drives(self, services: Mapping[str, Sequence[str]]) -> None:
        """Show the services of drives; ``services`` lists service names by drive."""
        found = {name: tuple(verbs) for name, verbs in services.items()}
        if found == self._drives:
            return
        self._drives, gui = found, self.server.gui
        self._drive_panel.remove()
        if self._disable is not None:
            self.live.remove(self._disable)
        with self._groups['Diagnose']:
            self._drive_panel = gui.add_folder(None)
        self._drive_panel.order = self._statuses.order + 0.5
        with self._drive_panel:
            self._drive = drive = gui.add_dropdown('Drive', (NO_DRIVE, ALL_DRIVES, *services))
            self._drive_state = gui.add_html('')
            verbs = {verb for each in services.values() for verb in each}
            for title, group in DRIVE_GROUPS.items():
                with gui.add_folder(title or None, expand_by_default=not title):
                    gui.add_html(THREE_COLUMNS)
                    for label, verb in group.items():
                        if verb in verbs:
                            press = partial(self._call, drive, label, verb)
                            add_button(gui, label, press, BUTTON_COLORS.get(verb, NEUTRAL))
                    if title and DISABLE in verbs:
                        self._add_disable(drive)

    def _add_disable(self, drive: GuiDropdownHandle[str]) -> None:
        pressed, last = math.inf, -math.inf

        def start() -> None:
            nonlocal pressed
            pressed = time.monotonic()

        def act() -> None:
            nonlocal pressed, last
            now = time.monotonic()
            if now - last > RELEASED_AFTER and pressed < math.inf:
                pressed = now  # delayed connection: the button may be released
            last = now
            if now - pressed >= DISABLE_AFTER:
                pressed = math.inf
                self._call(drive, 'Disable', DISABLE)

        hold = Hold(SINKS, act, lambda: None, start, always=True)
        self._disable, html = self.live.button(hold)
        self.server.gui.add_html(f'<div class="rv-one">{html}</div>')

    def offer_drive(self, offered: Offered) -> None:
        """Show the controls of an arm: joints, tool, targets and grippers."""
        if self._jog is not None:
            self._jog.offer(offered)

    def has(self, group: str) -> bool:
        """Return whether the present robot has a group."""
        return group in self._groups

    @contextmanager
    def place(self, group: str, panel: Panel) -> Iterator[None]:
        """Put elements added in the block into a group, replacing the panel of this type."""
        before = self._panels.pop(type(panel), None)
        if before is not None:
            before.remove()
        self._panels[type(panel)] = panel
        self._notes[group].visible = False
        with self._groups[group]:
            yield

    def offer_walk(self, *, policy: bool) -> None:
        """Show the hold-to-walk buttons, and the modes of the robot."""
        if self._modes or not self.has('Body'):
            if 'policy' in self._modes:
                self._modes['policy'].visible = policy
            return
        gui = self.server.gui
        self.velocity = lambda share: share * WALKS['Forward'][1][0]
        self._notes['Drive'].visible = False
        with self._groups['Drive']:
            rest = partial(self._actions.walk, (0.0, 0.0, 0.0))
            holds = []
            for title, (key, velocity) in WALKS.items():
                hold = Hold(title, partial(self._walk, velocity), rest, key=key)
                number, html = self.live.button(hold)
                self._walk_holds[number] = velocity
                holds.append(html)
            with gui.add_folder('Posture'):
                gui.add_html(THREE_COLUMNS)
                for label, mode in MODES.items():
                    color = BUTTON_COLORS.get(mode, NEUTRAL)
                    self._modes[mode] = add_button(gui, label, partial(self._request, mode), color)
                self._modes['policy'].visible = policy
            with gui.add_folder('Hold to walk'):
                gui.add_html(pad(holds[:WALK_BUTTONS]) + pad(holds[WALK_BUTTONS:], 'rv-keyed'))
                add_choice(gui, 'Gait', GAITS, lambda gait: self._request(f'gait:{gait}'))

    # -- what people do, in threads of the page

    def _command(self, word: str, rest: str) -> None:
        if word == 'act':
            self._actions.act(rest)
        elif word == 'cancel':
            self.cancel()
        elif word == 'say':
            self.say(rest, failed=True)

    def _stop(self) -> Future[Stop]:
        self.live.stop()  # else a held button would continue
        return self._actions.stop()

    def allow(self) -> None:
        """Allow the page to move the robot again after STOP; this itself moves nothing."""
        self.live.stopped = False

    def _walk(self, velocity: Velocity) -> None:
        x, y, turn = (self.speed() * part for part in velocity)
        self._actions.walk((x, y, turn))

    def _call(self, drive: GuiDropdownHandle[str], label: str, verb: str) -> None:
        if drive.value == NO_DRIVE:
            self.say(f'{label}: choose a drive first', failed=True)
        elif verb not in MOTIONS or not self.live.refuses(label):
            chosen = self._drives if drive.value == ALL_DRIVES else [drive.value]
            services = [f'{name}/{verb}' for name in chosen if verb in self._drives[name]]
            self._actions.call(f'{label} {drive.value.rpartition("/")[2]}', services)

    def _request(self, mode: str) -> None:
        if not self.live.refuses(f'mode {mode}'):
            self._actions.set_mode(mode)

    # -- the log

    def say(self, text: str, *, failed: bool | None = False) -> None:
        """Show the outcome of the last request; ``failed`` is None while unknown."""
        now = time.time()
        self.last = f'{time.strftime("%H:%M:%S", time.localtime(now))}  {text}'
        self._log.add(now, 'page', text, WARNING if failed is None else BAD if failed else GOOD)

    def log(self, at: float, who: str, text: str, *, failed: bool) -> None:
        """Store a log message of a node of the robot."""
        self._log.add(at, who, text, BAD if failed else WARNING)

    def list_log(self) -> None:
        """Show the log."""
        self._log_html.content = f'{COPY_LOG}<div>{self._log.html}</div>'
