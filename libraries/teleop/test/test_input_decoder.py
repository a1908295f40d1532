# SPDX-FileCopyrightText: 2026 The arm and quad developers
# SPDX-License-Identifier: Apache-2.0
from __future__ import annotations

from hypothesis import given
from hypothesis import strategies as st
import pytest

from operator_input import KeyAction, KeyEvent
from operator_input.key_decoder import KeyDecoder, Kitty, Report, ReportKind

PRESSED, REPEATED = KeyAction.PRESSED, KeyAction.REPEATED
RELEASED, TYPED = KeyAction.RELEASED, KeyAction.TYPED


def decode(text: str, *, kitty: bool = False) -> list[tuple[str, KeyAction]]:
    """Decode a text and return the keys."""
    decoder = KeyDecoder()
    decoder.reports_releases = kitty
    events = decoder.feed(text.encode(), 0.0)
    return [(event.key, event.action) for event in events if isinstance(event, KeyEvent)]


OLD = {
    'i': 'i', 'I': 'I', '<': '<', ' ': 'space', 'ш': 'ш', '\x1bi': 'alt+i',
    '\r': 'enter', '\t': 'tab', '\x7f': 'backspace',
    '\x03': 'ctrl+c', '\x1a': 'ctrl+z', '\x1c': 'ctrl+\\',
    # of xterm, the VT220 and modifyOtherKeys
    '\x1b[A': 'up', '\x1bOB': 'down', '\x1b[5~': 'page_up', '\x1b[6~': 'page_down',
    '\x1b[1~': 'home', '\x1b[H': 'home',
    '\x1bOP': 'f1', '\x1b[15~': 'f5', '\x1b[17~': 'f6', '\x1b[24~': 'f12',
    '\x1b[1;5C': 'ctrl+right', '\x1b[27;5;105~': 'ctrl+i', '\x1b[105;5u': 'ctrl+i',
}  # fmt: skip
KITTY = {
    # with and without the optional parts of the protocol
    '\x1b[105u': 'i', '\x1b[105;;105u': 'i', '\x1b[105;1:1;105u': 'i',
    '\x1b[105:73;2:1;73u': 'I', '\x1b[44:60;2:1;60u': '<', '\x1b[44:60;2u': '<',
    '\x1b[32;1:1;32u': 'space', '\x1b[13u': 'enter', '\x1b[27u': 'escape', '\x1b[99;5u': 'ctrl+c',
    # other layouts
    '\x1b[1089::99;5u': 'ctrl+c', '\x1b[1096::105;1:1;1096u': 'i',
    '\x1b[1096:1064:105;2:1;1064u': 'I',
    # Caps Lock and Num Lock
    '\x1b[105;65:1;73u': 'I', '\x1b[105;129:1;105u': 'i',
    # function keys and the keypad
    '\x1b[A': 'up', '\x1b[1;1:1A': 'up', '\x1b[5;1:1~': 'page_up',
    '\x1b[57407u': '8', '\x1b[57419u': 'up',
}  # fmt: skip


@pytest.mark.parametrize(('text', 'name'), OLD.items())
def test_old_encodings(text: str, name: str) -> None:
    """Characters and sequences name their key."""
    assert decode(text) == [(name, TYPED)]


@pytest.mark.parametrize(('text', 'name'), KITTY.items())
def test_kitty_presses(text: str, name: str) -> None:
    """Each form names the key meant."""
    assert decode(text, kitty=True) == [(name, PRESSED)]


@pytest.mark.parametrize(
    ('text', 'keys'),
    [
        ('\x1b[105;1:1;105u\x1b[105;1:2;105u\x1b[105;1:3u', '+i =i -i'),
        ('\x1b[1;1:1A\x1b[1;1:2A\x1b[1;1:3A', '+up =up -up'),
        # Shift let go of before the letter: the release still belongs to the capital
        ('\x1b[105:73;2:1;73u\x1b[105;1:3u', '+I -I'),
        # Shift while i is held: one is released before the other is pressed
        ('\x1b[105;1:1;105u\x1b[105:73;2:2;73u\x1b[105:73;2:3u', '+i -i +I -I'),
        # a key that was held before we looked, or was let go of, does not start by its repeat
        ('\x1b[105;1:2;105u', ''),
        # a release that happens in another window is never seen, so leaving the window counts
        ('\x1b[105;1:1;105u\x1b[O\x1b[105;1:2;105u', '+i *'),
        # Shift, Caps Lock and other modifiers are not "any other key"
        *((f'\x1b[{code};2:1u\x1b[{code};1:3u', '') for code in (57441, 57447, 57358, 57361)),
    ],
)
def test_kitty_presses_repeats_and_releases(text: str, keys: str) -> None:
    """Each key has its events, in both forms of the protocol."""
    signs = {PRESSED: '+', REPEATED: '=', RELEASED: '-', KeyAction.ALL_RELEASED: '*'}
    found = [f'{signs[action]}{key}' for key, action in decode(text, kitty=True)]
    assert ' '.join(found) == keys


@pytest.mark.parametrize('kitty', [False, True])
def test_a_code_that_is_no_character_is_no_key(kitty: bool) -> None:
    """Beyond Unicode, or half of a surrogate pair: passed over, and the next key is read.

    As shifted code, as text and as code of the Latin layout it leaves the name of the code.
    """
    for code in ('9999999', '1114112;2', '1114112;;105', '55296', '57343;2:1'):
        assert decode(f'\x1b[{code}uk', kitty=kitty) == [('k', TYPED)], code
    assert decode('\x1b[27;5;9999999~k', kitty=kitty) == [('k', TYPED)]
    text = '\x1b[105:9999999;2u\x1b[106;1;1114112u\x1b[1096::55296;1u'
    assert decode(text, kitty=True) == [('I', PRESSED), ('j', PRESSED), ('ш', PRESSED)]


def test_pasted_text_is_not_typed() -> None:
    """A paste moves nothing, what is typed after it does."""
    assert decode('\x1b[200~iiii\x1b[A\x1bOA\x1b[201~k') == [('k', TYPED)]


def test_reports() -> None:
    """Answers of the terminal are not keys."""
    events = KeyDecoder().feed(b'\x1b[?31u\x1b[?62;22c\x1b[0n', 0.0)
    assert events == [
        Report(ReportKind.KITTY_FLAGS, Kitty(31)),
        Report(ReportKind.DEVICE_ATTRIBUTES),
        Report(ReportKind.STATUS),
    ]


@pytest.mark.parametrize('text', ['\x1b]0;title\x07', '\x1bP1$r0m\x1b\\', '\x1b_Gi=1;OK\x1b\\'])
def test_strings_are_skipped(text: str) -> None:
    """Answers in strings, late ones of another program say, are not typed text."""
    keys = [key for key, _ in decode(f'{text}k')]
    assert 'k' in keys
    assert not set(keys) - {'k', 'alt+\\'}


def test_escape_key_comes_after_a_timeout() -> None:
    """An escape alone is the key, but only when nothing follows it."""
    decoder = KeyDecoder()
    assert decoder.feed(b'\x1b', 1.0) == []
    assert decoder.is_pending
    assert decoder.flush(1.1) == [KeyEvent('escape', TYPED, 1.1)]
    assert not decoder.is_pending


PARTS = ('i', 'ш', '\x1b[A', '\x1bOP', '\x1bx', '\x1b[?31u', '\x1b[200~p\x1b[201~')
KITTY_PARTS = ('\x1b[105;1:1;105u', '\x1b[105;1:3u', '\x1b[105:73;2:2;73u')
STREAMS = st.lists(st.sampled_from(PARTS + KITTY_PARTS), max_size=20).map(''.join)


@given(STREAMS, st.data())
def test_any_split_gives_the_same_keys(stream: str, data: st.DataObject) -> None:
    """Where a read ends does not matter, not even inside of a character."""
    octets = stream.encode()
    whole, parts = KeyDecoder(), KeyDecoder()
    whole.reports_releases = parts.reports_releases = True
    cuts = sorted(data.draw(st.sets(st.integers(0, len(octets)), max_size=6)))
    pieces = [octets[a:b] for a, b in zip([0, *cuts], [*cuts, len(octets)], strict=True)]
    found = [event for piece in pieces for event in parts.feed(piece, 0.0)]
    assert found == whole.feed(octets, 0.0)


@given(st.binary(max_size=300))
def test_noise_is_survived_and_forgotten(noise: bytes) -> None:
    """Whatever comes, nothing is raised, and a key after a pause is read again."""
    decoder = KeyDecoder()
    decoder.reports_releases = True
    decoder.feed(noise, 0.0)
    # ends an open sequence, string and paste
    decoder.feed(b'\x18' * 300 + b'\x1b[201~', 0.0)
    decoder.flush(0.0)
    assert decoder.feed(b'k', 1.0) == [KeyEvent('k', TYPED, 1.0)]
