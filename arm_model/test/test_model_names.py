# SPDX-FileCopyrightText: 2026 The arm and quad developers
# SPDX-License-Identifier: Apache-2.0
"""Names of joints and frames without kinematics; public names of the package in its README."""

from __future__ import annotations

from pathlib import Path

from model_robots import chain_texts, robot, ROBOTS, texts
import pytest

import arm_model
from arm_model import ModelError, names_of

ARRAYS = {'Array', 'ArmNames', 'Mask', 'Native', 'Places', 'Shape', 'checked', 'frozen'}

README = Path(__file__).parents[1] / 'README.md'


@pytest.mark.parametrize('name', ROBOTS)
def test_agrees_with_the_model(name: str) -> None:
    """The names are those of the motion core's model."""
    model, found = robot(name), names_of(*texts(name))
    assert (found.joints, found.base, found.tool) == (model.joints, model.base, model.tip)


@pytest.mark.parametrize('name', ROBOTS)
def test_without_srdf_the_longest_chain(name: str) -> None:
    """The description alone is enough for the joints."""
    assert names_of(texts(name)[0]).joints == robot(name).joints


def test_refusals() -> None:
    """Broken texts and a chain that is not there are refused in words."""
    urdf, srdf, _ = chain_texts('xyz')
    with pytest.raises(ModelError, match='no XML'):
        names_of('<robot')
    with pytest.raises(ModelError, match="no group 'leg'"):
        names_of(urdf, srdf, 'leg')
    with pytest.raises(ModelError, match="no link 'nowhere'"):
        names_of(urdf, srdf.replace('"base"', '"nowhere"'))


def test_loop_in_the_description() -> None:
    """A description that bites its tail is refused."""
    loop = (
        '<robot name="r"><link name="x"/><link name="y"/>'
        '<joint name="a" type="fixed"><parent link="x"/><child link="y"/></joint>'
        '<joint name="b" type="fixed"><parent link="y"/><child link="x"/></joint></robot>'
    )
    with pytest.raises(ModelError, match='loop'):
        names_of(loop)


def test_the_public_names_are_in_the_table() -> None:
    """All but those of arrays."""
    table = README.read_text(encoding='utf-8').partition('## Public API')[2].partition('\n## ')[0]
    missing = {name for name in arm_model.__all__ if f'`{name}`' not in table}
    assert missing == ARRAYS
