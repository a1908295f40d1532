# SPDX-FileCopyrightText: 2026 The arm and quad developers
# SPDX-License-Identifier: Apache-2.0
"""viser's client as a file of its own, which a browser compiles while it comes, and keeps.

viser packs its program and style sheet into its page: zstd in base 88, which each browser unpacks
at each opening before it compiles or shows anything. Here the server unpacks them, once.
"""

from __future__ import annotations

from functools import cache
import gzip
from hashlib import sha256
from http import HTTPStatus
import re

import numpy as np
from websockets.datastructures import Headers
from websockets.http11 import Response
import zstandard

PACKED = re.compile(rb'data-p="([^"]*)" data-ss="(\d+)" data-cs="(\d+)"')
"""In viser's page: style sheet and program, and the size of each in bytes."""
INLINE = b'e.type="module";e.textContent=code;'
"""In the loader of viser's page: how the program becomes a script."""
DIGITS = bytes(c for c in range(ord('!'), ord('~') + 1) if c not in b'"&\'<>`')
GROUP = 5  # digits of four bytes


@cache
def split(page: bytes) -> tuple[bytes, str, bytes]:
    """Return viser's page without its program, the path of that, and the program by gzip.

    A page that is packed in another way is returned as it is, with an empty path.
    """
    packed = PACKED.search(page)
    if packed is None or page.count(INLINE) != 1:
        return page, '', b''
    style_size, size = int(packed[2]), int(packed[2]) + int(packed[3])
    unpacked = zstandard.ZstdDecompressor().decompress(_decode(packed[1]), max_output_size=size)
    style, program = unpacked[:style_size], unpacked[style_size:]
    path = f'/client-{sha256(program).hexdigest()[:16]}.js'
    link = f'<link rel="modulepreload" href="{path}"><style>'.encode()
    rest = page.replace(packed[0], b'data-p="" data-ss="0" data-cs="1"')
    rest = rest.replace(INLINE, f'e.type="module";e.src="{path}";'.encode())
    rest = rest.replace(b'<script', link + style + b'</style><script', 1)
    return rest, path, gzip.compress(program, 1)


def _decode(text: bytes) -> bytes:
    """Decode base 88: five digits are four bytes, and the last digits one byte less."""
    values = np.zeros(256, np.uint64)
    values[list(DIGITS)] = range(len(DIGITS))
    digits, rest = values[np.frombuffer(text, np.uint8)], len(text) % GROUP
    groups = digits[: len(text) - rest].reshape(-1, GROUP)
    powers = np.array([len(DIGITS) ** n for n in reversed(range(GROUP))], np.uint64)
    last = 0
    for digit in digits[len(text) - rest :].tolist():
        last = last * len(DIGITS) + digit
    return (groups @ powers).astype('>u4').tobytes() + last.to_bytes(max(rest - 1, 0), 'big')


def response(program: bytes) -> Response:
    """Return the response with the program, which a browser may keep: another has another path."""
    headers = {
        'Content-Type': 'text/javascript',
        'Content-Encoding': 'gzip',
        'Content-Length': str(len(program)),
        'Cache-Control': 'private, max-age=31536000, immutable',
    }
    return Response(HTTPStatus.OK, HTTPStatus.OK.phrase, Headers(headers), program)
