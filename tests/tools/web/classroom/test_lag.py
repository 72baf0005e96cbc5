"""The page says so when a simulated robot runs slower than real time."""

from nxtdrive.tools.web.classroom.lag import LAG_S, WINDOW_S, LagMeter


def _lags(meter: LagMeter, pace: float, seconds: int, begin_s: int = 0) -> list[bool]:
    return [meter.lags(100.0 + begin_s + each, pace * each) for each in range(seconds)]


def test_a_robot_in_real_time_does_not_lag():
    assert not any(_lags(LagMeter(), 1.0, 60))
    assert not any(_lags(LagMeter(), 1.0 - 0.9 * LAG_S / WINDOW_S, 60)), "almost"


def test_a_robot_that_is_slower_lags_until_it_is_in_time_again():
    meter = LagMeter()
    assert _lags(meter, 0.8, 60)[-1]
    assert not _lags(LagMeter(), 0.8, 4)[-1], "it is hardly behind yet"
    ended_s = 0.8 * 60
    after = [meter.lags(160.0 + each, ended_s + each) for each in range(20)]
    assert after[0]
    assert not after[-1]


def test_a_clock_that_stands_still_on_purpose_does_not_count():
    meter = LagMeter()
    assert not any(_lags(meter, 1.0, 10))
    meter.reset()
    assert not any(_lags(meter, 1.0, 10, begin_s=60))
