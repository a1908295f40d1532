# SPDX-FileCopyrightText: 2026 The arm and quad developers
# SPDX-License-Identifier: Apache-2.0
"""What a page shows of a robot and lets people do: STOP, joints, drives, jogging, walking."""

from __future__ import annotations

from collections.abc import Callable, Collection, Mapping, Sequence
from concurrent.futures import Future
from contextlib import redirect_stdout
from dataclasses import dataclass, field
from functools import partial
from html import escape
import io
import time
from typing import Protocol, TypeAlias

from urdf_reader import JointKind, KinematicTree, Transform
from viser import (
    GuiButtonHandle,
    GuiDropdownHandle,
    GuiEvent,
    GuiFolderHandle,
    GuiHtmlHandle,
    GuiSliderHandle,
    GuiTabGroupHandle,
    GuiTabHandle,
    ViserServer,
)

from first_motion import JointKind as MotionKind

from ..loopback import shown_host
from .aim import History
from .body_panel import BodyPanel
from .deadman import Deadman, HEARTBEAT
from .drive_table import drive_html
from .first_motion_panel import FirstMotionActions, FirstMotionPanel
from .gate import Gate
from .jog_panel import JogActions, Jogged, JogPanel
from .log import Log
from .motion_plan import Order, PlanActions, SceneActions
from .overlay import Overlay, StopAnswer
from .plan_panel import PlanPanel
from .robot_scene import Ground, RobotScene, start_position, travel
from .sliders import add_speed, Share, value_of
from .style import CAUTION, NEUTRAL, THREE_COLUMNS, WANTED
from .target_panel import PlotPanel, TargetPanel

Velocity: TypeAlias = tuple[float, float, float]

SILENCE = 1.0
"""Without joint states after which the robot counts as out of reach in [s]."""
SILENT = (
    'nothing from the robot for {:.0f} s: is the link cut, or has it ended? What is held here '
    'stops by itself; STOP may not reach the rest: use the emergency stop'
)
WALKS: Mapping[str, Velocity] = {
    'forward': (0.3, 0.0, 0.0),
    'back': (-0.3, 0.0, 0.0),
    'left': (0.0, 0.15, 0.0),
    'right': (0.0, -0.15, 0.0),
    'turn left': (0.0, 0.0, 1.5),
    'turn right': (0.0, 0.0, -1.5),
}
"""Velocities at full speed: forwards and to the left in [m/s], of a turn in [rad/s]."""

COLORS = ('#2f9e44', '#e8a400', '#e03131', '#868e96')
"""Of the levels of a status: good, warning, error, stale."""
DRIVE_GROUPS: Mapping[str, tuple[str, ...]] = {
    '': ('enable', 'recover', 'halt'),
    'Mode': (
        'cyclic_position_mode',
        'interpolated_position_mode',
        'position_mode',
        'velocity_mode',
    ),
    'Seldom needed': ('init', 'home', 'quick_stop', 'disable'),
}
"""Services of a drive by what they are for; what has a title is folded."""
BUTTON_COLORS = {
    'enable': WANTED,
    'home': CAUTION,
    'quick_stop': CAUTION,
    'disable': CAUTION,
    'relax': CAUTION,
}
STALE = 3
WORST = (2, STALE, 1, 0)
"""Levels of a status, the worst first."""


@dataclass(frozen=True, slots=True)
class Status:
    """How something is.

    Attributes:
        name: What.
        level: 0 good, 1 warning, 2 error, 3 stale, as in diagnostic_msgs.
        message: In words.
        values: What was measured, by name.
    """

    name: str
    level: int
    message: str
    values: Mapping[str, str] = field(default_factory=dict)


class Actions(JogActions, Protocol):
    """What a page may have done; any thread may call it, and none of it waits."""

    def stop(self) -> Future[StopAnswer]:
        """Stop whatever moves; the future has the robot's answer."""

    def call(self, service: str) -> None:
        """Call a Trigger service."""

    def walk(self, velocity: Velocity) -> None:
        """Command a velocity in [m/s] and [rad/s] once."""

    def set_mode(self, mode: str) -> None:
        """Request a mode of a walking robot."""

    def publish_joints(self, positions: Mapping[str, float]) -> None:
        """Publish joint states."""

    def aim(self, controller: str, targets: Mapping[str, float], share: float) -> None:
        """Send the joints of a controller to targets, at a share of their greatest velocity."""


class RobotPage:
    """A page in a browser; shows come from one thread, actions leave in any.

    Attributes:
        url: Where it is, with the token where it needs one.
    """

    def __init__(self, host: str, port: int, actions: Actions) -> None:
        self._actions = actions
        self._deadman = Deadman()
        gate = Gate(host, Overlay(self._stop))
        with gate.before(), redirect_stdout(io.StringIO()):  # viser draws its own banner
            self._server = ViserServer(host, port, label='robot', verbose=False)
        self.url = f'http://{shown_host(host)}:{self._server.get_port()}'
        if gate.token:
            self.url += f'/?token={gate.token}'
        self._scene: RobotScene | None = None
        gui = self._server.gui
        gui.configure_theme(show_logo=False, show_share_button=False, brand_color=WANTED)
        gui.main_panel.dock_right()
        self._server.scene.set_up_direction('+z')
        self._ground = Ground(self._server.scene)
        self._answer = gui.add_html(_line('no robot description yet', COLORS[3]))
        self._silence: GuiHtmlHandle = gui.add_html('')
        self._tabs: GuiTabGroupHandle = gui.add_tab_group()
        self._pages: dict[str, GuiTabHandle] = {}
        self._units: dict[str, str] = {}
        self._joints: GuiHtmlHandle | None = None
        self._sliders: dict[str, GuiSliderHandle[float]] = {}
        self._statuses: GuiHtmlHandle | None = None
        self._offered: set[str] = set()
        self._drives: dict[str, tuple[str, ...]] = {}
        self._drive_panel: GuiFolderHandle | None = None
        self._drive: GuiDropdownHandle[str] | None = None
        self._drive_state: GuiHtmlHandle | None = None
        self._targets: dict[str, TargetPanel] = {}
        self._plots: PlotPanel | None = None
        self._plan: PlanPanel | None = None
        self._body: BodyPanel | None = None
        self._first_motion: FirstMotionPanel | None = None
        self._jog: JogPanel | None = None
        self._jogged: tuple[KinematicTree, Jogged] | None = None
        self._log = Log()
        self._log_html: GuiHtmlHandle | None = None
        self._tree: KinematicTree | None = None

    @property
    def watched(self) -> bool:
        """Whether a page is open."""
        return bool(self._server.get_clients())

    def close(self) -> None:
        """Serve it no more."""
        with redirect_stdout(io.StringIO()):
            self._server.stop()

    def show_robot(self, tree: KinematicTree) -> list[str]:
        """Show another robot; return what of it cannot be shown, in words."""
        if self._plan is not None:
            self._plan.remove()
            self._plan = None
        if self._body is not None:
            self._body.remove()
            self._body = None
        if self._scene is not None:
            self._scene.remove()
        self.offer_sliders(offered=False)
        self._tree = tree
        slides = {joint.name for joint in tree.movable() if joint.kind is JointKind.PRISMATIC}
        self._units = {j.name: 'm' if j.name in slides else 'rad' for j in tree.movable()}
        self._scene = RobotScene(self._server.scene, tree)
        far = 0.65 * self._scene.size + 0.25  # [m]
        self._server.initial_camera.position = (far, -far, 0.9 * far)
        self._server.initial_camera.look_at = (0.0, 0.0, 0.3 * self._scene.size)
        for client in self._server.get_clients().values():
            client.camera.position = self._server.initial_camera.position
            client.camera.look_at = self._server.initial_camera.look_at
        self.say(f'robot {tree.name}')
        return self._scene.notes

    def show_joints(self, positions: Mapping[str, float]) -> None:
        """Show where the joints are in [rad] and [m]."""
        if self._scene is not None:
            self._scene.place(positions)

    def list_joints(self, positions: Mapping[str, float], age: float | None) -> None:
        """Show the numbers of the joints, and how old they are in [s]; None for never."""
        if self._joints is None:
            with self._tab('Joints'):
                self._joints = self._server.gui.add_html('')
        old = 'no joint states' if age is None else f'{age:.1f} s old' if age > 1.0 else ''
        rows = [
            (name, f'{positions[name]:+.3f} {unit}')
            for name, unit in self._units.items()
            if name in positions
        ]
        self._joints.content = _table(rows) + (_line(old, COLORS[1]) if old else '')
        if self._jog is not None:
            self._jog.show(positions if age is not None and age < SILENCE else {})

    def show_silence(self, age: float | None) -> None:
        """Show a banner while nothing is received from the robot."""
        text = '' if age is None or age <= SILENCE else _line(SILENT.format(age), COLORS[2])
        if self._silence.content != text:
            self._silence.content = text

    def show_base(self, pose: Transform) -> None:
        """Show how the root link is in the world, and that it moves there."""
        if self._scene is not None:
            self._scene.place_base(self._ground.pass_below(pose))

    def show_statuses(self, statuses: Sequence[Status]) -> None:
        """Show how everything is, what is worst first."""
        self._show_drive(statuses)
        if self._statuses is None:
            with self._tab('Status'):
                self._statuses = self._server.gui.add_html('')
        ordered = sorted(statuses, key=lambda status: (WORST.index(status.level), status.name))
        self._statuses.content = ''.join(
            f'{_line(status.name, COLORS[status.level], strong=True)}'
            f'<div style="margin:0 0 0.5em 1em">{escape(status.message)}</div>'
            for status in ordered
        )

    def offer_sliders(self, *, offered: bool) -> None:
        """Offer sliders of the joints, where no other node publishes them."""
        tree = self._tree
        if tree is None or offered is bool(self._sliders):
            return
        if not offered:
            for slider in self._sliders.values():
                slider.remove()
            self._sliders = {}
            return
        with self._tab('Joints'):
            for joint in tree.movable():
                if joint.mimic is None:
                    low, high = travel(joint)
                    slider = self._server.gui.add_slider(
                        joint.name, low, high, (high - low) / 1000.0, start_position(joint)
                    )
                    slider.on_update(lambda _: self._publish_sliders())
                    self._sliders[joint.name] = slider
        self._publish_sliders()

    def offer_drives(self, services: Mapping[str, Sequence[str]]) -> None:
        """Offer the services of drives: their names by the drive."""
        found = {name: tuple(verbs) for name, verbs in services.items()}
        if found == self._drives:
            return
        if self._drive_panel is not None:
            self._drive_panel.remove()
        self._drives, gui = found, self._server.gui
        with self._tab('Drives'):
            self._drive_panel = gui.add_folder(None)
        with self._drive_panel:
            self._drive = drive = gui.add_dropdown('Drive', ('all', *services))
            self._drive_state = gui.add_html('')
            verbs = {verb for each in services.values() for verb in each}
            for title, group in DRIVE_GROUPS.items():
                offered = [verb for verb in group if verb in verbs]
                if offered:
                    with gui.add_folder(title or None, expand_by_default=not title):
                        gui.add_html(THREE_COLUMNS)
                        for verb in offered:
                            self._add_verb(verb, found, drive)

    def _add_verb(
        self, verb: str, found: Mapping[str, Sequence[str]], drive: GuiDropdownHandle[str]
    ) -> None:
        label, color = verb.replace('_', ' '), BUTTON_COLORS.get(verb, NEUTRAL)
        button = self._server.gui.add_button(label, color=color)
        button.on_click(partial(self._call, found, drive, verb))

    def _show_drive(self, statuses: Sequence[Status]) -> None:
        """Show what the chosen drive reports; of all drives those that are not well."""
        if self._drive is None or self._drive_state is None:
            return
        drives = {status.name: status for status in statuses if status.name.endswith(': drive')}
        buses = [status for status in statuses if status.name.endswith(': bus')]
        chosen = drives.get(f'{self._drive.value.rpartition("/")[2]}: drive')
        if chosen is not None:
            bus = buses[0].values if len(buses) == 1 else {}
            self._drive_state.content = drive_html(chosen.message, chosen.values, bus)
            return
        unwell = [status for status in drives.values() if status.level]
        self._drive_state.content = ''.join(
            _line(f'{status.name}: {status.message}', COLORS[status.level]) for status in unwell
        ) or _line('no drive reports anything wrong', COLORS[0])

    def offer_targets(self, controller: str, joints: Sequence[str]) -> bool:
        """Offer to send the joints of a controller somewhere; whether it could be."""
        tree = self._tree
        if tree is None or controller in self._targets:
            return tree is not None
        movable = {joint.name: joint for joint in tree.movable()}
        known = [movable[name] for name in joints if name in movable]
        with self._tab('Targets'):
            self._targets[controller] = TargetPanel(
                self._server, known, partial(self._actions.aim, controller)
            )
        return True

    def follow(self, controller: str, *, busy: bool, positions: Mapping[str, float]) -> None:
        """Set the sliders of a controller to its joints' positions."""
        if controller in self._targets:
            self._targets[controller].follow(positions, busy=busy)

    def plot(self, history: History, now: float) -> None:
        """Draw what the joints did until now."""
        if self._plots is None and history.joints:
            with self._tab('Plots'):
                self._plots = PlotPanel(self._server, history.joints)
        if self._plots is not None:
            self._plots.show(history, now)

    def offer_plan(
        self, groups: Sequence[str], actions: tuple[PlanActions, SceneActions, Order]
    ) -> PlanPanel | None:
        """Offer to plan motions, for the robot that is shown now.

        Returns:
            Where to show what is planned; None as long as there is no robot.
        """
        if self._scene is None or self._tree is None:
            return None
        with self._tab('Plan'):
            self._plan = PlanPanel(self._server, self._scene, self._tree, groups, actions)
        return self._plan

    def offer_body(self) -> BodyPanel | None:
        """Offer what is known of the body of a walking robot; None as long as there is none."""
        if self._scene is None or self._tree is None:
            return None
        with self._tab('Body'):
            self._body = BodyPanel(self._server, self._scene.path_of(self._tree.root))
        return self._body

    def offer_first_motion(
        self, joints: Mapping[str, MotionKind], actions: FirstMotionActions
    ) -> FirstMotionPanel:
        """Offer the first motion of joints, in the place of those before."""
        if self._first_motion is not None:
            self._first_motion.remove()
        with self._tab('First motion'):
            self._first_motion = FirstMotionPanel(self._server, joints, actions, self._held)
        return self._first_motion

    def offer_jog(self, joints: Sequence[str], grippers: Sequence[str]) -> None:
        """Offer to jog the tool and joints as long as a button is held, and to move grippers."""
        jogged = Jogged(tuple(joints), tuple(grippers), self._actions)
        if self._tree is None or (self._tree, jogged) == self._jogged:
            return
        if self._jog is not None:
            self._jog.remove()
        with self._tab('Jog'):
            self._jog = JogPanel(self._server, self._tree, jogged, self._held)
        self._jogged = self._tree, jogged

    def offer_walk(self, modes: Collection[str]) -> None:
        """Offer to walk as long as a button is held, and the modes of the robot."""
        if not self._offer('Walk'):
            return
        with self._tab('Walk'):
            self._server.gui.add_html(THREE_COLUMNS)
            for mode in modes:
                color = BUTTON_COLORS.get(mode, NEUTRAL)
                button = self._server.gui.add_button(mode, color=color)
                button.on_click(partial(self._request, mode))
            speed = add_speed(self._server.gui)
            rest = partial(self._actions.walk, (0.0, 0.0, 0.0))
            for title, velocity in WALKS.items():
                self._held(title, partial(self._walk, speed, velocity), rest)

    def _stop(self) -> Future[StopAnswer]:
        self._deadman.stop()  # or a button that is held would go on
        try:
            for panel in list(self._targets.values()):
                panel.lock()  # or a slider that is dragged
            if (body := self._body) is not None:
                body.lock()
        finally:  # whatever fails on the page
            answer = self._actions.stop()
        return answer

    def say(self, text: str, *, failed: bool | None = False) -> None:
        """Show what became of the last request; with None that is not known yet."""
        color = COLORS[1 if failed is None else 2 if failed else 0]
        self._answer.content = _line(text, color)
        self._log.add(time.time(), 'page', text, color)

    def log(self, at: float, who: str, text: str, *, failed: bool) -> None:
        """Keep what a node of the robot said."""
        self._log.add(at, who, text, COLORS[2 if failed else 1])

    def list_log(self) -> None:
        """Show what was said."""
        if self._log_html is None:
            with self._tab('Log'):
                self._log_html = self._server.gui.add_html('')
        if self._log_html.content != self._log.html:
            self._log_html.content = self._log.html

    def _offer(self, what: str) -> bool:
        """Whether something is offered for the first time; it stays as it was then."""
        new = what not in self._offered
        self._offered.add(what)
        return new

    def _tab(self, label: str) -> GuiTabHandle:
        if label not in self._pages:
            self._pages[label] = self._tabs.add_tab(label)
        return self._pages[label]

    def _held(
        self, label: str, act: Callable[[], None], rest: Callable[[], None]
    ) -> GuiButtonHandle:
        """Add a button that acts as long as it is held, and rests when it is let go."""
        which = object()

        def beat(event: GuiEvent[GuiButtonHandle]) -> None:
            if self._deadman.beat(event.client_id, which, time.monotonic()):
                act()

        def release(event: GuiEvent[GuiButtonHandle]) -> None:
            if self._deadman.release(event.client_id, which, time.monotonic()):
                rest()

        button = self._server.gui.add_button(label, color=NEUTRAL)
        button.on_hold(beat, 1.0 / HEARTBEAT)
        button.on_click(release)  # a click ends where the button is let go
        return button

    def _walk(self, speed: Share, velocity: Velocity) -> None:
        x, y, turn = (speed() * part for part in velocity)
        self._actions.walk((x, y, turn))

    def _call(
        self,
        services: Mapping[str, Sequence[str]],
        drive: GuiDropdownHandle[str],
        verb: str,
        _: object,
    ) -> None:
        chosen = services if drive.value == 'all' else [drive.value]
        for name in chosen:
            if verb in services[name]:
                self._actions.call(f'{name}/{verb}')

    def _request(self, mode: str, _: object) -> None:
        self._actions.set_mode(mode)

    def _publish_sliders(self) -> None:
        self._actions.publish_joints({n: value_of(each) for n, each in self._sliders.items()})


def _line(text: str, color: str, *, strong: bool = False) -> str:
    weight = 'bold' if strong else 'normal'
    return (
        f'<div style="font-weight:{weight};margin:0.2em 1em"><span style="color:{color}">&#9679;'
        f'</span> {escape(text)}</div>'
    )


def _table(rows: Sequence[tuple[str, str]]) -> str:
    cells = ''.join(
        f'<tr><td>{escape(name)}</td><td style="text-align:right">{escape(value)}</td></tr>'
        for name, value in rows
    )
    return f'<table style="margin:0 1em;font-variant-numeric:tabular-nums">{cells}</table>'
