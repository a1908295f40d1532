# SPDX-FileCopyrightText: 2026 The arm and quad developers
# SPDX-License-Identifier: Apache-2.0
"""Set-points of a first motion in the modes 7 and 8, and the correction of a bus.yml."""

from __future__ import annotations

import math
from pathlib import Path

from eds_samples import DRIVE_ROWS, eds_text
from hypothesis import given
from hypothesis import strategies as st
import pytest

from arm_canopen import AxisFeedback, DriveState, load_bus, Refusal, RefusalCause
from canopen_tools.first_motion.movers import PERMIT, RAMP_TIME, SlowMotion
from canopen_tools.first_motion.program import apply
from first_motion import AxisScales, Cause, Judgement, propose, Verdict

BUS = """\
# mine
master: {node_id: 1, driver: ros2_canopen::MasterDriver, package: canopen_master_driver}
defaults:
  dcf: drive.eds
  driver: ros2_canopen::Cia402Driver
  package: canopen_402_driver
nodes:
  shoulder:  # the first one
    node_id: 2
    scale_pos_to_dev: 500.0   # by hand
    scale_pos_from_dev: 0.002
  elbow: {node_id: 3}  # short
  wrist:
    # behind the others
    node_id: 4
"""


def feedback(position: float, *, followable: bool = True) -> list[AxisFeedback]:
    """Return what the master knows of a drive."""
    return [
        AxisFeedback(
            'shoulder', True, DriveState.OPERATION_ENABLED, 8, position, 0.0, position, followable
        )
    ]


@given(
    permits=st.lists(st.booleans(), min_size=1, max_size=300),
    distance=st.floats(0.001, 0.2) | st.floats(-0.2, -0.001),
    speed=st.floats(0.005, 0.1),
    period=st.sampled_from((0.001, 0.004, 0.01, 0.02)),
)
def test_set_points_are_slow_and_end_with_the_permission(
    permits: list[bool], distance: float, speed: float, period: float
) -> None:
    """No step in speed, none beyond the target; and it stands soon after the last permission."""
    motion = SlowMotion('shoulder', 0.3 + distance, speed)
    now, position, velocity = 10.0, 0.3, 0.0
    for permitted in [*permits, *[False] * math.ceil((PERMIT + RAMP_TIME) / period + 2)]:
        if permitted:
            motion.permit(now + PERMIT)
        (answer,) = motion.update(now, period, feedback(position))
        assert answer is not None
        new = (answer - position) / period
        assert abs(new) <= speed * (1 + 1e-6)
        assert (answer - 0.3) / distance <= 1.0 + 1e-9
        assert (answer - 0.3) / distance >= -1e-9
        reached = answer == 0.3 + distance
        assert reached or abs(new - velocity) <= speed / RAMP_TIME * period * (1 + 1e-6)
        now, position, velocity = now + period, answer, new
    assert velocity == 0.0


def test_a_drive_that_was_taken_away_gets_nothing() -> None:
    """The reason is kept."""
    motion = SlowMotion('shoulder', 1.0, 0.1)
    motion.permit(math.inf)
    assert motion.update(0.0, 0.01, feedback(0.0, followable=False)) == (None,)
    motion.released('shoulder', Refusal(RefusalCause.FAULT, 'hot'))
    assert motion.update(0.01, 0.01, feedback(0.0)) == (None,)
    assert motion.problem == 'shoulder is faulted: hot'


@pytest.mark.parametrize('device', ['shoulder', 'elbow', 'wrist'])
def test_a_bus_yml_is_changed_in_place(device: str, tmp_path: Path) -> None:
    """Keys of one device; every other line stays as it is, every comment, too."""
    (tmp_path / 'drive.eds').write_text(eds_text(DRIVE_ROWS))
    path = tmp_path / 'bus.yml'
    path.write_text(BUS)
    path.chmod(0o640)
    before = {node.name: node.drive for node in load_bus(path).nodes}
    judgement = Judgement(Verdict.WRONG_SIGN_AND_SCALE, -1, 4.0)
    scales = AxisScales.of(before[device])
    correction = propose(scales, judgement, Cause(4.0, 'four edges'))
    assert any('scale_acc_to_dev' in note for note in correction.notes)
    apply(correction, path, device, device, None)
    after = {node.name: node.drive for node in load_bus(path).nodes}
    for key, value in correction.values.items():
        assert getattr(after[device], key) == value
    assert {name: each for name, each in after.items() if name != device} == {
        name: each for name, each in before.items() if name != device
    }
    text = path.read_text()
    for comment in ('# mine', '# the first one', 'by hand', '# short', '# behind the others'):
        assert comment in text
    reason = '# first motion: the sign was wrong, and four edges; scale_pos_to_dev was'
    assert (reason in text) is (device != 'elbow')  # which is written in a line
    changed = [line for line in BUS.splitlines() if line not in text.splitlines()]
    assert all('scale' in line or 'elbow' in line for line in changed)
    assert path.stat().st_mode & 0o777 == 0o640
    assert [each.name for each in tmp_path.iterdir() if each.suffix == '.new'] == []
