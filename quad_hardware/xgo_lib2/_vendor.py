# SPDX-FileCopyrightText: 2026 The arm and quad developers
# SPDX-License-Identifier: Apache-2.0
"""Finds the vendor's xgo_lib2 and replaces this stand-in by it.

A colcon workspace is in ``PYTHONPATH``, which precedes site-packages, so the stand-in is found
first. A module may replace itself in :data:`sys.modules` during its import; submodules then come
from the replacement.
"""

from __future__ import annotations

from importlib.machinery import ModuleSpec, PathFinder
from importlib.util import module_from_spec
from pathlib import Path
import sys

_OWN_MARK = Path(__file__).name  # every copy of ours has this module


def find_vendor(name: str) -> ModuleSpec | None:
    """Return the location of another package with this name; None if there is none."""
    for entry in sys.path:
        spec = PathFinder.find_spec(name, [entry])
        if _is_vendor(spec):
            return spec
    for finder in sys.meta_path:  # packages installed in editable mode bring their own finder
        if finder is not PathFinder and _is_vendor(spec := finder.find_spec(name, None)):
            return spec
    return None


def take_over(name: str) -> None:
    """Replace a module by the vendor's module of the same name, if installed."""
    spec = find_vendor(name)
    if spec is None or spec.loader is None:
        return
    module = module_from_spec(spec)
    sys.modules[name] = module
    spec.loader.exec_module(module)


def _is_vendor(spec: ModuleSpec | None) -> bool:
    if spec is None or spec.origin is None or spec.loader is None:
        return False
    return not Path(spec.origin).with_name(_OWN_MARK).exists()
