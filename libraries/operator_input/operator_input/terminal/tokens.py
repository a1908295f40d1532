# SPDX-FileCopyrightText: 2026 The arm and quad developers
# SPDX-License-Identifier: Apache-2.0
"""Splits what a terminal sends into characters and control sequences (ECMA-48, section 5.4)."""

from __future__ import annotations

import codecs
from dataclasses import dataclass
from enum import auto, Enum

ESC = '\x1b'
_STRING_STARTS = frozenset('P]X^_')  # DCS, OSC, SOS, PM, APC: up to ST or BEL
_PASTE_START, _PASTE_END = '200', '201'  # bracketed paste (xterm)
_LONGEST_SEQUENCE = 256  # characters; what is longer is noise


class TokenKind(Enum):
    """What a terminal can send."""

    TEXT = auto()
    """One character."""

    ALT = auto()
    """One character with Alt: an escape before it."""

    CSI = auto()
    """A control sequence with parameters."""

    SS3 = auto()
    """A function key in the VT100's application mode."""


@dataclass(frozen=True, slots=True)
class Token:
    """A character or a control sequence.

    Attributes:
        kind: Which of both.
        final: The character, or the last one of the sequence, which names it.
        parameters: What stands between in a CSI sequence, a private mark first.
    """

    kind: TokenKind
    final: str
    parameters: str = ''


class _State(Enum):
    GROUND = auto()
    ESCAPE = auto()
    CSI = auto()
    SS3 = auto()
    STRING = auto()


class Tokenizer:
    """Incremental: bytes may be cut anywhere. Pasted text is dropped, no hand typed it."""

    def __init__(self) -> None:
        self._decoder = codecs.getincrementaldecoder('utf-8')('replace')
        self._state = _State.GROUND
        self._parameters = ''
        self._pasting = False
        self._length = 0  # characters of a string that is skipped

    @property
    def is_pending(self) -> bool:
        """Whether the last characters may be the begin of a sequence, or an escape of its own."""
        return self._state is not _State.GROUND

    def feed(self, data: bytes) -> list[Token]:
        """Split bytes.

        Args:
            data: What has been read, in any portions.

        Returns:
            What is complete with these bytes.
        """
        tokens = []
        for character in self._decoder.decode(data):
            token = self._take(character)
            if token is not None and not self._is_paste(token):
                tokens.append(token)
        return tokens

    def flush(self) -> list[Token]:
        """Give up waiting for the rest of a sequence.

        Returns:
            The escape key, if that is what was pending.
        """
        was, self._state = self._state, _State.GROUND
        if was is _State.ESCAPE and not self._pasting:
            return [Token(TokenKind.TEXT, ESC)]
        return []

    def _take(self, character: str) -> Token | None:
        match self._state:
            case _State.GROUND:
                return self._ground(character)
            case _State.ESCAPE:
                return self._escape(character)
            case _State.CSI:
                return self._csi(character)
            case _State.SS3:
                return self._end(TokenKind.SS3, character)
            case _State.STRING:
                return self._string(character)

    def _ground(self, character: str) -> Token | None:
        if character != ESC:
            return Token(TokenKind.TEXT, character)
        self._state = _State.ESCAPE
        return None

    def _escape(self, character: str) -> Token | None:
        if character == ESC:  # the escape key before a sequence, or twice
            return Token(TokenKind.TEXT, ESC)
        if character == '[':
            self._state, self._parameters = _State.CSI, ''
            return None
        if character == 'O':
            self._state = _State.SS3
            return None
        if character in _STRING_STARTS:
            self._state, self._length = _State.STRING, 0
            return None
        return self._end(TokenKind.ALT, character)

    def _csi(self, character: str) -> Token | None:
        if '@' <= character <= '~':
            return self._end(TokenKind.CSI, character)
        if character == ESC:  # cut off in the middle: a new one begins
            self._state = _State.ESCAPE
            return None
        self._parameters += character
        if not ' ' <= character <= '?' or len(self._parameters) > _LONGEST_SEQUENCE:
            self._state = _State.GROUND
        return None

    def _string(self, character: str) -> Token | None:
        self._length += 1
        if character == ESC:  # of ST, whose second half then is an Alt key that no keyboard has
            self._state = _State.ESCAPE
        elif character == '\a' or self._length > _LONGEST_SEQUENCE:
            self._state = _State.GROUND
        return None

    def _end(self, kind: TokenKind, final: str) -> Token:
        self._state = _State.GROUND
        return Token(kind, final, self._parameters if kind is TokenKind.CSI else '')

    def _is_paste(self, token: Token) -> bool:
        if token.kind is TokenKind.CSI and token.final == '~':
            if token.parameters == _PASTE_START:
                self._pasting = True
                return True
            if token.parameters == _PASTE_END:
                self._pasting = False
                return True
        return self._pasting
