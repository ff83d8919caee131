"""The tension controller against theory: closed forms on an integrator, no windup, no dependence on the period."""

import tracemalloc
from math import exp, inf, nan, pi

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from tendonrod.errors import InvalidInput
from tendonrod.rig.control import KI, KP, LowPass, Ramp, TensionController, braked

C = 3.3e-3  # m/N


def closed_loop(controller, seconds, rate=1000.0, target=lambda t: 0.0, screw=lambda t: 0.0, tension=0.0, ahead=0.0):
    """(n,) tensions of an integrator: c dtau/dt = v - screw velocity, sampled at ``rate``."""
    dt, found = 1.0 / rate, []
    for k in range(round(seconds * rate)):
        found.append(tension)
        tension += dt * (controller.update(target(k * dt) - tension, dt, ahead) - screw(k * dt)) / C
    return np.array(found)


def test_the_step_response_is_that_of_the_second_order_loop():
    """tau / target = (kp s + ki) / (c s^2 + kp s + ki), overdamped at the paper's gains."""
    found = closed_loop(TensionController(limit=1e3), 4.0, 20_000.0, lambda t: 0.7)
    t = np.arange(found.size) / 20_000.0
    a, b = np.roots([C, KP, KI])
    exact = 0.7 * (1 + ((KI / C / a + KP / C) * np.exp(a * t) - (KI / C / b + KP / C) * np.exp(b * t)) / (a - b))
    assert np.abs(found - exact).max() < 5e-4 * 0.7
    assert pytest.approx(1.946, abs=1e-3) == KP / (2 * (KI * C) ** 0.5)  # damping


@pytest.mark.parametrize("feed_forward", [False, True])
def test_a_screw_at_a_steady_rate_leaves_no_error(feed_forward):
    """The screw is a steady disturbance before the integrator, where the integral cancels it; peak about rate / kp."""
    controller, rate = TensionController(feed_forward=feed_forward), 1e-3
    found = closed_loop(controller, 15.0, target=lambda t: 0.7, screw=lambda t: rate, tension=0.7, ahead=rate)
    error = 0.7 - found
    assert abs(error[-1]) < 1e-6
    assert error.max() < 1e-6 if feed_forward else 0.5 * rate / KP < error.max() < rate / KP


def test_an_accelerating_screw_leaves_the_error_of_theory():
    found = closed_loop(TensionController(), 15.0, target=lambda t: 0.7, screw=lambda t: 1e-4 * t, tension=0.7)
    assert 0.7 - found[-1] == pytest.approx(1e-4 / KI, rel=1e-3)


def test_a_rising_target_is_followed_without_error():
    found = closed_loop(TensionController(), 15.0, target=lambda t: 0.3 + 0.02 * t, tension=0.3)
    assert abs(found[-1] - (0.3 + 0.02 * 14.999)) < 1e-5


def test_the_period_does_not_matter():
    """The difference of two rates is that of their delays, first order in the period."""
    slow = closed_loop(TensionController(limit=4e-3), 5.0, 100.0, lambda t: 0.7)
    fast = closed_loop(TensionController(limit=4e-3), 5.0, 1000.0, lambda t: 0.7)[::10]
    assert np.abs(slow - fast).max() < 0.01 * 0.7


def test_uneven_periods_integrate_the_same():
    rng = np.random.default_rng(1)
    even, uneven = TensionController(kp=0.0, limit=1e3), TensionController(kp=0.0, limit=1e3)
    steps = rng.uniform(1e-4, 2e-2, 500)
    for t, dt in zip(np.cumsum(steps), steps, strict=True):
        uneven.update(2.0 * t, dt)
    for k in range(1, 50_001):
        even.update(2.0 * k * steps.sum() / 50_000, steps.sum() / 50_000)
    assert uneven.integral == pytest.approx(even.integral, rel=1e-3)


def overshoot(anti_windup: str) -> float:
    """Above a target that was out of reach for 20 s: the actuator gives no more than its limit meanwhile."""
    controller = TensionController(limit=2e-3, anti_windup=anti_windup)
    found = closed_loop(controller, 60.0, 200.0, lambda t: 0.7, lambda t: 2.5e-3 if t < 20 else 0.0, 0.7)
    return float(found.max() - 0.7)


def test_saturation_winds_nothing_up():
    assert overshoot("none") > 1.0
    assert overshoot("conditional") < 0.05
    assert overshoot("back-calculation") < 0.05


@given(st.lists(st.tuples(st.floats(allow_nan=True), st.floats(0.0, 1.0)), max_size=60))
def test_whatever_comes_the_limits_hold(given_):
    controller, before = TensionController(limit=3e-3, acceleration=0.02), 0.0
    for error, dt in given_:
        velocity = controller.update(error, dt)
        assert abs(velocity) <= 3e-3
        assert abs(controller.integral) <= 3e-3
        assert abs(velocity - before) <= 0.02 * min(dt, 0.1) * (1 + 1e-9) + 1e-18
        before = velocity


def test_a_missing_reading_slows_down_and_is_not_integrated():
    controller = TensionController(acceleration=0.02)
    for _ in range(100):
        controller.update(0.05, 5e-3)
    held = controller.integral
    velocities = [controller.update(nan, 5e-3) for _ in range(50)]
    assert velocities[-1] == 0.0
    assert velocities == sorted(velocities, reverse=True)
    assert controller.integral == held


def test_a_pause_is_not_integrated_over():
    controller = TensionController(kp=0.0)
    controller.update(0.1, 5e-3)
    controller.update(0.1, 60.0)
    assert controller.integral == pytest.approx(KI * 0.1 * 0.105)


def test_reset_forgets_and_goes_on_without_a_jump():
    controller = TensionController(acceleration=0.01)
    controller.update(1.0, 0.05)
    controller.reset(2e-3)
    assert (controller.integral, controller.velocity) == (0.0, 2e-3)
    assert controller.update(0.0, 5e-3) == pytest.approx(2e-3 - 0.01 * 5e-3)


def test_feed_forward_is_off_unless_asked_for():
    assert TensionController().update(0.0, 5e-3, 1e-3) == 0.0
    assert TensionController(feed_forward=True).update(0.0, 5e-3, 1e-3) == 1e-3


def test_updates_keep_no_memory():
    controller = TensionController(acceleration=0.02)
    controller.update(0.1, 5e-3)
    tracemalloc.start()
    before = tracemalloc.get_traced_memory()[0]
    for k in range(2000):
        controller.update(0.1 * (-1) ** k, 5e-3)
    grown = tracemalloc.get_traced_memory()[0] - before
    tracemalloc.stop()
    assert grown < 500  # bytes: the last floats


@pytest.mark.parametrize(
    ("field", "value"),
    [("kp", -1.0), ("ki", nan), ("limit", 0.0), ("acceleration", -1.0), ("anti_windup", "clamp")],
)
def test_bad_gains_are_refused_by_name(field, value):
    with pytest.raises(InvalidInput) as caught:
        TensionController(**{field: value})
    assert caught.value.field == field


def test_a_ramp_reaches_what_it_can():
    ramp = Ramp(1.0, 2.0)
    assert [ramp.update(5.0, 0.1) for _ in range(7)][-1] == 1.0
    assert ramp.update(nan, 0.1) == pytest.approx(0.8)
    assert Ramp().update(-3.0, 0.0) == -3.0


def test_the_filter_is_first_order_whatever_the_period():
    for count in (3, 700):
        low = LowPass(0.5)
        low.update(0.0, 0.1)
        for _ in range(count):
            low.update(1.0, 1.0 / count)
        assert low.value == pytest.approx(1 - exp(-2))
    assert LowPass(0.0).update(2.0, 0.1) == 2.0
    assert low.update(nan, 0.1) == low.value


@pytest.mark.parametrize("acceleration", [0.01, 1.0, inf])
@pytest.mark.parametrize("dt", [1e-3, 1e-2])
def test_a_braked_axis_stops_at_the_end(acceleration, dt):
    position = 0.0
    for _ in range(10_000):
        position += dt * braked(0.02, 0.05 - position, acceleration, dt)
    assert position == pytest.approx(0.05, abs=1e-6)
    assert position <= 0.05 + 1e-12
    assert braked(-pi, nan, 1.0, dt) == 0.0
