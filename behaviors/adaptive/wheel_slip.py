"""Notice a wheel that slips: the robot turns otherwise than its wheels do, as the frames show.

A wheel may slip for minutes, on dust or with a cable under it; the robot then drives in circles while, by odometry, it
drives straight. How far the camera turned from frame to frame is compared with how far the wheels say. Once they
differ by more than errors explain, the pose follows the camera. Where a frame is blurred, it follows the wheels, less
the share of its way that the wheel lost lately, and that wheel turns faster. All this ends when camera and wheels agree
again.
"""

from __future__ import annotations

import math
from collections import deque
from collections.abc import Callable, Iterable
from dataclasses import dataclass
from itertools import islice
from statistics import fmean
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from behaviors.events import Measured
from behaviors.ports import Glimpse, Pose
from behaviors.pose_history import PoseHistory

WINDOW_S = 2.0
"""Turns are compared over this time."""
LONGEST_S = 0.4
"""Where frames or poses are farther apart than this, turns are not compared: it is not known when the robot turned."""
ERROR_DEG, ERROR_SHARE = 8.0, 0.15
"""Turns that differ by this, plus this share of them, agree: fields of view and tracks are known to about 15 %."""
LAGS_S = (0.0, 0.15, 0.3, 0.45)
"""A frame may be older than its time says by one of these; the one with which camera and wheels agree best is used."""
GRIP_SHARE, SLIP_SHARE = 0.35, 0.65
"""Once it is known how much a wheel loses when it slips, that makes turns differ by a known angle. If errors do not
explain so much, the wheel grips where they differ by less than the first share of it, and slips from the second on."""
LEAST_SHARE = 0.07
"""It also grips when it loses less than this share of its way."""
MAX_LOST_SHARE = 0.85
"""A wheel loses no more than this share of its way. A larger difference has another cause: something moves in front of
the camera, the robot is carried, or the motors are exchanged."""
MOST_MORE = 1.0
"""A wheel that slips turns no more than twice as fast to make up for it."""
DISTRUST_S = 30.0
"""Then the frames are not believed for this time."""
KEPT_SHARE = 0.97
"""Of what earlier frames showed about the lost share, this is left after each further one."""

LEFT = 0
NAMES = ("left", "right")
TINY = 1e-9
Array = NDArray[np.float64]


class SlipCorrection(NamedTuple):
    """What the wheels did not show.

    Attributes:
        turned_deg: Turn, positive right.
        moved_mm: Way along the heading.
    """

    turned_deg: float
    moved_mm: float


@dataclass(slots=True)
class _Interval:
    """The time between two frames.

    Attributes:
        end_s: When it ended.
        seen_deg: How far the camera turned, positive right; None where the frames do not show it.
        whole_deg: For each of `LAGS_S`, how much farther to the right the robot turns if the left, or the right, wheel
            loses its whole way.
        guessed_deg: By how much the pose was corrected although the frames do not show it.
    """

    end_s: float
    seen_deg: float | None
    whole_deg: tuple[tuple[float, float], ...]
    guessed_deg: float = 0.0

    def off_deg(self, lag: int) -> float:
        """Return how much farther to the right the camera turned than the wheels say; 0 where it is not known."""
        return 0.0 if self.seen_deg is None else self.seen_deg + sum(self.whole_deg[lag])


class WheelSlip:
    """Compares how far camera and wheels turned.

    Args:
        track_mm: Distance between the wheels.

    Attributes:
        slips: Whether a wheel slips now.
    """

    def __init__(self, track_mm: float) -> None:
        self._degree_mm = math.radians(track_mm)
        self.slips = False
        self._wheels = PoseHistory()
        self._last = Pose()
        self._last_s = self._gap_s = -math.inf
        self._way_mm = self._heading_deg = 0.0
        self._seen: tuple[float, list[Pose]] | None = None
        self._intervals: deque[_Interval] = deque()
        self._misfits = [0.0] * len(LAGS_S)
        self._lag = 0
        self._products, self._squares = np.zeros(2), np.zeros(2)
        self._wheel, self._share = LEFT, 0.0
        self._shares: list[float] = []
        self._begun_s = self._distrusted_until_s = -math.inf

    @property
    def evidence(self) -> Measured:
        """Which wheel slips or slipped, which share of its way it lost on average, 0..1, and for how long."""
        slipped_s = self._intervals[-1].end_s - self._begun_s
        return {"wheel": NAMES[self._wheel], "lost_share": fmean(self._shares), "slipped_s": slipped_s}

    def compensated(self, speed_mm_s: float, turn_deg_s: float) -> tuple[float, float]:
        """Return how to drive forward so that the robot moves like this, with a wheel that loses a share of its way.

        A turn on the spot stays one, since the safety stop may hold a robot that drives forward.
        """
        if not self.slips or speed_mm_s <= 0.0:
            return speed_mm_s, turn_deg_s
        side = 1 if self._wheel == LEFT else -1
        wheel_mm_s = speed_mm_s + side * self._degree_mm * turn_deg_s / 2
        more_mm_s = wheel_mm_s * min(self._share / (1.0 - self._share), MOST_MORE)
        return speed_mm_s + more_mm_s / 2, turn_deg_s + side * more_mm_s / self._degree_mm

    def restart(self) -> None:
        """Begin again after the pose was corrected by others."""
        self._wheels.clear()
        self._intervals.clear()
        self._last_s, self._seen = -math.inf, None

    def add_pose(self, time_s: float, pose: Pose) -> None:
        """Add the pose by the wheels and all corrections so far."""
        if math.isfinite(self._last_s):
            self._way_mm += self._last.forward_mm_to(pose)
            self._heading_deg += pose.heading_deg - self._last.heading_deg
        if time_s - self._last_s > LONGEST_S:
            self._gap_s = time_s
        self._last, self._last_s = pose, time_s
        self._wheels.add(time_s, Pose(self._way_mm, 0.0, self._heading_deg))

    def correction(self, glimpse: Glimpse) -> SlipCorrection | None:
        """Return by how much to correct the pose, which then has to be corrected; None if both wheels grip.

        Args:
            glimpse: The next one; `add_pose` has been called since it was taken.
        """
        interval = self._next(glimpse)
        if interval is None:
            return None
        self._intervals.append(interval)
        while self._intervals[0].end_s < interval.end_s - WINDOW_S:
            self._intervals.popleft()
        if not self.slips:
            self._learn_lag(interval)
            if not self._share and abs(self._off_deg(self._lag)) <= ERROR_DEG:
                return None  # the usual case, decided quickly
        if interval.end_s < self._distrusted_until_s:
            return None
        if abs(self._off_deg(self._lag)) > self._most_deg + self._error_deg:
            self.slips, self._distrusted_until_s = False, interval.end_s + DISTRUST_S
            return None
        if not self.slips:
            return self._begin() if self._begins else None
        if self._grips:
            return self._end()
        self._products, self._squares = self._learned(interval, KEPT_SHARE * self._products, KEPT_SHARE * self._squares)
        self._estimate()
        return self._corrected(self._missed_deg(interval))

    def _next(self, glimpse: Glimpse) -> _Interval | None:
        """Return the time since the last glimpse."""
        now = [self._wheels.at(glimpse.time_s - lag_s) for lag_s in LAGS_S]
        seen, self._seen = self._seen, (glimpse.time_s, now)
        if seen is None:
            return None
        since_s, then = seen
        seen_deg = None
        if glimpse.time_s - since_s <= LONGEST_S and since_s - LAGS_S[-1] >= self._gap_s:
            seen_deg = glimpse.turned_deg
        return _Interval(glimpse.time_s, seen_deg, tuple(map(self._whole_deg, then, now)))

    def _whole_deg(self, then: Pose, now: Pose) -> tuple[float, float]:
        turned_deg, driven_deg = now.heading_deg - then.heading_deg, (now.x_mm - then.x_mm) / self._degree_mm
        return -driven_deg - turned_deg / 2, driven_deg - turned_deg / 2

    def _learn_lag(self, interval: _Interval) -> None:
        """Learn how late frames are, while both wheels grip."""
        self._misfits = [KEPT_SHARE * old + interval.off_deg(lag) ** 2 for lag, old in enumerate(self._misfits)]
        self._lag = self._misfits.index(min(self._misfits))

    def _begin(self) -> SlipCorrection | None:
        """Find out since when the wheel slips: the time over which a slip explains most."""
        sums, since, most = (np.zeros(2), np.zeros(2)), 0, 0.0
        best = sums
        for number in reversed(range(len(self._intervals))):
            sums = self._learned(self._intervals[number], *sums)
            explained = float(_explained(*sums).max())
            if explained > most:
                best, since, most = sums, number, explained
        intervals = deque(islice(self._intervals, since, None))
        if self._are_exchanged(intervals, most):
            return None
        self.slips, self._begun_s, self._intervals = True, self._intervals[-1].end_s, intervals
        self._products, self._squares = best
        self._shares.clear()
        self._estimate()
        return self._corrected(self._sum(self._missed_deg))

    def _are_exchanged(self, intervals: Iterable[_Interval], explained: float) -> bool:
        """Return whether exchanged motors, with which a robot turns the other way, explain the turns better."""
        seen = [each for each in intervals if each.seen_deg is not None]
        slipping = sum(each.off_deg(self._lag) ** 2 for each in seen) - explained
        exchanged = (
            sum((each.off_deg(lag) - 2.0 * sum(each.whole_deg[lag])) ** 2 for each in seen)
            for lag in range(len(LAGS_S))
        )
        return min(exchanged) < slipping

    def _end(self) -> SlipCorrection:
        """Take back what was guessed since the wheel grips: the time in which the turns agree best."""
        guessed_deg = wrong_deg = better_deg = best_deg = 0.0
        for each in reversed(self._intervals):
            guessed_deg += each.guessed_deg
            if each.seen_deg is not None:
                expected_deg = self._share * each.whole_deg[self._lag][self._wheel]
                better_deg += math.copysign(1.0, self._expected_deg) * (expected_deg - 2.0 * each.off_deg(self._lag))
            if better_deg > best_deg:
                best_deg, wrong_deg = better_deg, guessed_deg
        self.slips, self._intervals = False, deque([self._intervals[-1]])
        return self._corrected(-wrong_deg)

    def _learned(self, interval: _Interval, products: Array, squares: Array) -> tuple[Array, Array]:
        """Return the sums for the least squares of what each wheel loses, with a further time."""
        if interval.seen_deg is None:
            return products, squares
        whole_deg = np.array(interval.whole_deg[self._lag])
        return products + interval.off_deg(self._lag) * whole_deg, squares + whole_deg**2

    def _estimate(self) -> None:
        """Estimate which wheel slips, and which share of its way it loses."""
        self._wheel = int(_explained(self._products, self._squares).argmax())
        share = self._products[self._wheel] / max(self._squares[self._wheel], TINY)
        self._share = min(max(0.0, float(share)), MAX_LOST_SHARE)
        self._shares.append(self._share)

    def _missed_deg(self, interval: _Interval) -> float:
        """Return how much farther to the right the robot turned than the wheels say; a guess if no frame shows it."""
        if interval.seen_deg is not None:
            return interval.off_deg(self._lag)
        interval.guessed_deg = self._share * interval.whole_deg[self._lag][self._wheel]
        return interval.guessed_deg

    def _corrected(self, turned_deg: float) -> SlipCorrection:
        """Return a correction, and note that the next pose contains it."""
        moved_mm = self._degree_mm * turned_deg / 2 * (1 if self._wheel == LEFT else -1)
        self._last = self._last.corrected(turned_deg, moved_mm)
        return SlipCorrection(turned_deg, moved_mm)

    @property
    def _grips(self) -> bool:
        """Whether the wheel that slipped does so no more."""
        expected_deg = self._expected_deg
        clearly = abs(expected_deg) > self._error_deg and self._off_deg(self._lag) / expected_deg < GRIP_SHARE
        return clearly or self._share < LEAST_SHARE

    @property
    def _begins(self) -> bool:
        """Whether a wheel has begun to slip."""
        if min(abs(self._off_deg(lag)) for lag in range(len(LAGS_S))) > self._error_deg:
            return abs(self._off_deg(self._lag)) <= self._most_deg
        expected_deg = self._expected_deg
        return abs(expected_deg) > self._error_deg and self._off_deg(self._lag) / expected_deg > SLIP_SHARE

    @property
    def _most_deg(self) -> float:
        """By how much camera and wheels may differ if a wheel slips."""
        side = math.copysign(1.0, self._off_deg(self._lag))
        ways_deg = np.maximum(0.0, side * np.array([each.whole_deg[self._lag] for each in self._intervals]))
        return MAX_LOST_SHARE * float(ways_deg.sum(axis=0).max())

    def _off_deg(self, lag: int) -> float:
        """Return how much farther to the right the camera turned than the wheels say, if frames are that late."""
        return self._sum(lambda each: each.off_deg(lag))

    @property
    def _expected_deg(self) -> float:
        """The same, if the wheel slips that slipped last."""
        return self._share * self._sum(
            lambda each: 0.0 if each.seen_deg is None else each.whole_deg[self._lag][self._wheel]
        )

    @property
    def _error_deg(self) -> float:
        """By how much camera and wheels may differ without slip."""
        return ERROR_DEG + ERROR_SHARE * self._sum(lambda each: abs(sum(each.whole_deg[self._lag])))

    def _sum(self, value: Callable[[_Interval], float]) -> float:
        return sum(map(value, self._intervals))


def _explained(products: Array, squares: Array) -> Array:
    """Return by how much a slip of each wheel reduces the squares of the differences between camera and wheels."""
    return np.asarray(np.maximum(products, 0.0) ** 2 / np.maximum(squares, TINY))
