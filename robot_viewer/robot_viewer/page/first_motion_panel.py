# SPDX-FileCopyrightText: 2026 The arm and quad developers
# SPDX-License-Identifier: Apache-2.0
"""The first motion of a joint on a page: what is requested, seen and concluded."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import Protocol

from viser import GuiDropdownHandle, GuiHtmlHandle, GuiNumberHandle, ViserServer

from first_motion import Cause, FASTEST, FURTHEST, JointKind, Judgement, MotionGuard

from .first_motion import MotionRequest, Saw
from .live import Hold, Live
from .style import BAD, CAUTION, GOOD, line, NEUTRAL, PLAIN, WANTED

DISTANCE = 1.0
"""In the unit of people, degrees or millimetres."""
SPEEDS = {JointKind.TURNS: 0.5, JointKind.SLIDES: 1.0}
"""In the same unit per second: slow enough to let go in time, whatever the scale is by ten."""
HOLD = 'Hold to move'
PRESS_ANEW = 'let go of the button, and press it anew'
CHOOSE = 'choose'


class FirstMotionActions(Protocol):
    """What people do; any thread may call it, and none of it waits."""

    def prepare(self, request: MotionRequest) -> None:
        """Enable the drive, and say what will happen."""

    def forget(self) -> None:
        """Another joint was chosen: what was prepared counts no more."""

    def beat(self) -> None:
        """Process a valid heartbeat of the held button."""

    def release(self) -> None:
        """The button was let go."""

    def finish(self) -> None:
        """It is enough: end the motion before its target."""

    def conclude(self, saw: Saw, distance: float) -> None:
        """Conclude from what was seen, and how far about it was in [rad] or [m]."""

    def choose(self, cause: Cause) -> None:
        """Choose one of several causes."""

    def write(self) -> None:
        """Change bus.yml."""


class FirstMotionPanel:
    """Asks for what people do, and shows what it is given; it decides nothing."""

    def __init__(
        self,
        server: ViserServer,
        joints: Mapping[str, JointKind],
        actions: FirstMotionActions,
        live: Live,
    ) -> None:
        self._joints, self._actions, self._live = joints, actions, live
        self._hold: int | None = None  # while a motion is prepared
        self._kind = next(iter(joints.values()))
        self._causes: Mapping[str, Cause] = {}
        gui = server.gui
        self._folder = gui.add_folder(None)
        with self._folder:
            self._joint: GuiDropdownHandle[str] = gui.add_dropdown('Joint', tuple(joints))
            self._distance: GuiNumberHandle[float] = gui.add_number('Distance', DISTANCE, step=0.1)
            self._speed: GuiNumberHandle[float] = gui.add_number('Speed', SPEEDS[self._kind])
            self._prepare = gui.add_button('Enable and prepare', color=WANTED)
            self._state: GuiHtmlHandle = gui.add_html('')
            self._place_of_hold: GuiHtmlHandle = gui.add_html('')
            self._enough = gui.add_button('That is enough', color=NEUTRAL)
            self._saw: GuiDropdownHandle[str] = gui.add_dropdown(
                'What you saw', tuple(each.value for each in Saw)
            )
            self._far: GuiNumberHandle[float] = gui.add_number('How far', DISTANCE, step=0.01)
            self._conclude = gui.add_button('Conclude', color=NEUTRAL)
            self._verdict: GuiHtmlHandle = gui.add_html('')
            self._cause: GuiDropdownHandle[str] = gui.add_dropdown('Cause', (CHOOSE,))
            self._lines = gui.add_markdown('')
            self._write = gui.add_button('Write it into bus.yml', color=CAUTION)
            self._note: GuiHtmlHandle = gui.add_html('')
        self._joint.on_update(lambda _: self._select())
        self._prepare.on_click(lambda _: self._ask())
        self._enough.on_click(lambda _: actions.finish())
        self._conclude.on_click(
            lambda _: actions.conclude(
                Saw(self._saw.value), abs(self._far.value) * self._kind.size
            )
        )
        self._cause.on_update(lambda _: self._choose())
        self._write.on_click(lambda _: actions.write())
        self._use_units()
        self.begin('', failed=False)

    def remove(self) -> None:
        """Remove it from the page."""
        self._drop_hold()
        self._folder.remove()

    # -- what is shown

    def begin(self, text: str, *, failed: bool) -> None:
        """Show that nothing is prepared, and why."""
        self._prepare.disabled = False
        self._state.content = line(text, BAD if failed else PLAIN) if text else ''
        self._show(moves=False, asks=False, concluded=False)

    def show_waiting(self, text: str, *, failed: bool) -> None:
        """Show what is waited for; nothing can be prepared meanwhile."""
        self._prepare.disabled = True
        self._state.content = line(text, BAD if failed else PLAIN)
        self._show(moves=False, asks=False, concluded=False)

    def show_ready(self, announced: Sequence[str]) -> None:
        """Show what will happen, and offer the button."""
        self._prepare.disabled = False
        self._state.content = ''.join(line(text, PLAIN) for text in announced)
        self._note.content = ''
        self._show(moves=True, asks=False, concluded=False)

    def show_progress(self, guard: MotionGuard, *, press_anew: bool) -> None:
        """Show how far it is, and that the button does not count until it was let go."""
        kind, distance = self._kind, guard.plan.distance
        way = f'{guard.travelled / kind.size:.3f} of {kind.shown(abs(distance))}'
        state, color = ('moving', GOOD) if guard.moving else ('at rest', PLAIN)
        if press_anew:
            state, color = PRESS_ANEW, BAD
        self._note.content = line(f'{state}: {way}', color)

    def ask(self, ended: str, reported: float) -> None:
        """Ask what was seen of a motion that has ended."""
        kind = self._kind
        self._state.content = line(
            f'{ended}; the drive reported {kind.shown(reported)}', PLAIN
        ) + line('What did the real joint do?', PLAIN)
        self._far.value = round(abs(reported) / kind.size, 3)  # type: ignore[misc]
        self._note.content = ''
        self._show(moves=False, asks=True, concluded=False)

    def show_judgement(self, judgement: Judgement, *, right: bool) -> None:
        """Show what is concluded."""
        causes = [f'{each.text} (factor {each.factor:.4g})' for each in judgement.causes]
        texts = [judgement.remedy] if judgement.remedy else causes
        self._verdict.content = line(judgement.verdict.value, GOOD if right else BAD) + ''.join(
            line(text, PLAIN) for text in texts
        )
        self._causes = dict(zip(causes, judgement.causes, strict=True))
        self._cause.options = (CHOOSE, *causes)
        self._cause.value = CHOOSE  # type: ignore[misc]
        self._show(moves=False, asks=True, concluded=True)
        self._cause.visible = len(causes) > 1

    def show_correction(self, lines: str, notes: Sequence[str], *, writable: bool) -> None:
        """Show what to write."""
        self._lines.content = f'```yaml\n{lines}\n```'
        self._lines.visible = True
        self._write.visible = writable
        self._note.content = ''.join(line(text, PLAIN) for text in notes)

    def show_written(self, text: str, *, failed: bool) -> None:
        """Show what became of the file."""
        self._write.visible = False
        self._note.content = line(text, BAD if failed else GOOD)

    def _show(self, *, moves: bool, asks: bool, concluded: bool) -> None:
        self._drop_hold()  # what is pressed for a motion moves nothing in the next one
        if moves:
            actions = self._actions
            self._hold, html = self._live.button(
                Hold(HOLD, actions.beat, actions.release, always=True)
            )
            self._place_of_hold.content = f'<div class="rv-one">{html}</div>'
        self._enough.visible = moves
        for question in (self._saw, self._far, self._conclude):
            question.visible = asks
        self._verdict.visible = concluded
        self._cause.visible = self._lines.visible = self._write.visible = False
        if not moves and not asks:
            self._note.content = ''

    def _drop_hold(self) -> None:
        if self._hold is not None:
            self._live.remove(self._hold)
            self._hold, self._place_of_hold.content = None, ''

    # -- what people do

    def _select(self) -> None:
        self._actions.forget()
        self._use_units()

    def _use_units(self) -> None:
        kind = self._kind = self._joints[self._joint.value]
        furthest, fastest = FURTHEST[kind] / kind.size, FASTEST[kind] / kind.size
        self._distance.label = f'Distance [{kind.value}]'
        self._distance.min, self._distance.max = -furthest, furthest
        self._distance.value = DISTANCE  # type: ignore[misc]  # it has a setter
        self._speed.label = f'Speed [{kind.value}/s]'
        self._speed.min, self._speed.max, self._speed.step = 0.1, fastest, 0.1
        self._speed.value = SPEEDS[kind]  # type: ignore[misc]
        self._far.label = f'How far [{kind.value}]'

    def _ask(self) -> None:
        size = self._kind.size
        self._actions.prepare(
            MotionRequest(self._joint.value, self._distance.value * size, self._speed.value * size)
        )

    def _choose(self) -> None:
        cause = self._causes.get(self._cause.value)
        if cause is not None:
            self._actions.choose(cause)
