# SPDX-FileCopyrightText: 2026 The arm and quad developers
# SPDX-License-Identifier: Apache-2.0
"""From the bytes of a terminal to key events and reports."""

from __future__ import annotations

from ..keys import all_released, KeyAction, KeyEvent
from .key_names import character_name, FINAL_NAMES
from .kitty_key import kitty_key, KittyKey
from .reports import Kitty, Report, ReportKind
from .tokens import Token, Tokenizer, TokenKind

_FOCUS_IN, _FOCUS_OUT = 'I', 'O'  # xterm's mode 1004


class KeyDecoder:
    """Turns bytes into key events, of every encoding that terminals use.

    Attributes:
        reports_releases: Whether the terminal has confirmed to report releases; then a key is
            PRESSED, otherwise TYPED.
    """

    def __init__(self) -> None:
        self.reports_releases = False
        self._tokenizer = Tokenizer()
        self._down: dict[str, str] = {}  # name that a key had when it went down, by its code

    @property
    def is_pending(self) -> bool:
        """Whether an escape waits for what may follow; then call flush() soon."""
        return self._tokenizer.is_pending

    @property
    def is_holding(self) -> bool:
        """Whether a key is down whose release the terminal is to report."""
        return bool(self._down)

    def feed(self, data: bytes, now: float) -> list[KeyEvent | Report]:
        """Decode bytes.

        Args:
            data: What has been read, in any portions.
            now: Time [s].
        """
        return self._decode(self._tokenizer.feed(data), now)

    def flush(self, now: float) -> list[KeyEvent | Report]:
        """Decode what is pending as if nothing would follow.

        Args:
            now: Time [s].
        """
        return self._decode(self._tokenizer.flush(), now)

    def forget(self) -> None:
        """Forget which keys are down, as after all of them were let go of."""
        self._down.clear()

    def _decode(self, tokens: list[Token], now: float) -> list[KeyEvent | Report]:
        return [event for token in tokens for event in self._of(token, now)]

    def _of(self, token: Token, now: float) -> list[KeyEvent | Report]:
        match token.kind:
            case TokenKind.TEXT:
                return [KeyEvent(character_name(token.final), KeyAction.TYPED, now)]
            case TokenKind.ALT:
                return [KeyEvent(f'alt+{character_name(token.final)}', KeyAction.TYPED, now)]
            case TokenKind.SS3:
                name = FINAL_NAMES.get(token.final)
                return [KeyEvent(name, KeyAction.TYPED, now)] if name else []
            case TokenKind.CSI:
                return self._of_csi(token, now)

    def _of_csi(self, token: Token, now: float) -> list[KeyEvent | Report]:
        if token.final in {_FOCUS_IN, _FOCUS_OUT} and not token.parameters:
            if token.final == _FOCUS_IN:
                return []
            self.forget()
            return [all_released(now)]
        report = _report(token)
        if report is not None:
            return [report]
        if token.parameters.startswith(('?', '>', '<', '=')):
            return []
        key = kitty_key(token)
        return list(self._of_key(key, now)) if key is not None else []

    def _of_key(self, key: KittyKey, now: float) -> list[KeyEvent]:
        if key.is_release:
            name = self._down.pop(key.code, key.name)
            return [KeyEvent(name, KeyAction.RELEASED, now)] if name else []
        if not key.name:
            return []
        if not self.reports_releases:
            return [KeyEvent(key.name, KeyAction.TYPED, now)]
        return self._press(key, now)

    def _press(self, key: KittyKey, now: float) -> list[KeyEvent]:
        before = self._down.get(key.code)
        if key.is_repeat and before == key.name:
            return [KeyEvent(key.name, KeyAction.REPEATED, now)]
        events = []
        if before is not None and before != key.name:  # Shift went down or up meanwhile
            events.append(KeyEvent(before, KeyAction.RELEASED, now))
        elif key.is_repeat:  # went down before we looked, or all keys were let go of
            return []
        self._down[key.code] = key.name
        return [*events, KeyEvent(key.name, KeyAction.PRESSED, now)]


def _report(token: Token) -> Report | None:
    if token.final == 'u' and token.parameters.startswith('?'):
        digits = token.parameters[1:]
        is_number = digits.isascii() and digits.isdigit() and len(digits) < 4
        return Report(ReportKind.KITTY_FLAGS, Kitty(int(digits) & 31 if is_number else 0))
    if token.final == 'c' and token.parameters.startswith('?'):
        return Report(ReportKind.DEVICE_ATTRIBUTES)
    if token.final == 'n':
        return Report(ReportKind.STATUS)
    return None
