# SPDX-FileCopyrightText: 2026 The arm and quad developers
# SPDX-License-Identifier: Apache-2.0
"""Looks for the vendor's xgo_lib2 behind our own, and puts it in our place.

A colcon workspace stands in ``PYTHONPATH``, which comes before site-packages, so ours is found
first. The import system allows a module to replace itself in :data:`sys.modules` while it is
imported; submodules are then taken from the replacement.
"""

from __future__ import annotations

from importlib.machinery import ModuleSpec, PathFinder
from importlib.util import module_from_spec
from pathlib import Path
import sys

_OWN_MARK = Path(__file__).name  # every copy of ours has this module


def find_vendor(name: str) -> ModuleSpec | None:
    """Return where a package of a name is that is not ours; None where there is none."""
    for entry in sys.path:
        spec = PathFinder.find_spec(name, [entry])
        if _is_vendor(spec):
            return spec
    for finder in sys.meta_path:  # packages installed in editable mode bring their own finder
        if finder is not PathFinder and _is_vendor(spec := finder.find_spec(name, None)):
            return spec
    return None


def take_over(name: str) -> None:
    """Replace the module of a name by the vendor's, where there is one."""
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
