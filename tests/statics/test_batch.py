"""A batch is so many single solves: the same numbers, in the same order, whatever the threads, and never an exception
for an item's failure.
"""

import _thread
import pickle
import threading
import time
import tracemalloc
from types import SimpleNamespace

import numpy as np
import pytest

from tendonrod import InvalidInput, Shape, Status, Tendon, solve
from tendonrod.statics import batch_work
from tendonrod.statics.batch import solve_batch
from tendonrod.statics.batch_inputs import Inputs
from tendonrod.statics.equilibrium import prepare
from tendonrod.statics.solution import Solution
from textbook import GRAVITY, helix_rod, prototype, rod

COLUMN = rod(length=0.3)
NAMES = ("position", "rotation", "v", "u", "force", "moment", "centerline")
NAN, INF = float("nan"), float("inf")


def random_loads(items: int, n_tendons: int, seed: int = 0) -> dict[str, np.ndarray]:
    """Loads of all kinds, a tenth of them heavy, some of the robots nearly or wholly retracted."""
    rng = np.random.default_rng(seed)
    size = np.where(rng.random(items) < 0.1, 8.0, 1.0)[:, None]
    insertion = rng.uniform(0.05, 1.0, items)
    insertion[::17] = 0.0
    return {
        "tensions": size * rng.uniform(0.0, 1.0, (items, n_tendons)),
        "gravity": 9.81 * rng.normal(size=(items, 3)),
        "tip_force": 0.02 * size * rng.normal(size=(items, 3)),
        "tip_moment": 5e-4 * size * rng.normal(size=(items, 3)),
        "distributed_force": 0.1 * rng.normal(size=(items, 3)),
        "distributed_moment": 1e-3 * rng.normal(size=(items, 3)),
        "insertion": insertion,
        "rotation": rng.uniform(-7.0, 7.0, items),
        "accuracy": 10.0 ** rng.uniform(-8.0, -5.0, items),
    }


def item(loads: dict[str, np.ndarray], i: int) -> dict:
    return {field: values[i].tolist() for field, values in loads.items()}


def assert_item_is_shape(batch, i: int, shape: Shape, accuracy: float = 1e-6):
    """The same kernel, compiled into another loop: equal but for rounding, which may cost or save an iteration."""
    assert batch.status[i] is shape.status
    found = [batch.load_factor[i], batch.error_estimate[i], batch.steps[i]]
    steps = shape.steps if shape.converged else 0
    np.testing.assert_allclose(found, [shape.load_factor, shape.error_estimate, steps], rtol=1e-2, atol=1e-15)
    near = {"rtol": 0.0, "atol": 0.1 * accuracy, "equal_nan": True}
    np.testing.assert_allclose(batch.tip[i], shape.tip, **near)
    at = shape.at(batch.fractions * shape.length) if batch.fractions.size else shape
    scales = {"force": 1e2, "moment": 1.0, "u": 1e5}  # N/m, N and 1/m2: what a displacement means for them at most here
    for name in set(NAMES) & batch.arrays.keys():
        near["atol"] = 0.1 * accuracy * scales.get(name, 1e3)
        np.testing.assert_allclose(getattr(batch, name)[i], getattr(at, name), **near, err_msg=name)


@pytest.mark.parametrize("robot", [prototype(1), helix_rod(), COLUMN], ids=["one", "three", "none"])
def test_every_item_is_its_single_solve(robot):
    loads = random_loads(120, robot.n_tendons)
    batch = solve_batch(robot, **loads, points=5, outputs=("tip", "tip_rotation", *NAMES))
    assert len(batch) == 120
    assert batch.counts[Status.CONVERGED] > 60
    for i in range(120):
        assert_item_is_shape(batch, i, solve(robot, **item(loads, i), throw=False), loads["accuracy"][i])


def test_hard_and_impossible_items_end_as_in_single_solves():
    """Past Euler's load, where the cold start is not enough; and crushed."""
    force = [[1e-5 * k, 0.0, -0.05 * k] for k in range(40)]
    pushed = solve_batch(COLUMN, tip_force=force)
    for i, each in enumerate(force):
        assert_item_is_shape(pushed, i, solve(COLUMN, tip_force=each, throw=False))
    crushed = [[0.5, 0.2, 0.1], [9e4, 0.0, 0.0], [3.0, 1.0, 8.0], [1e5, 1e5, 0.0], [0.1, 0.2, 0.3]]
    batch = solve_batch(helix_rod(), crushed, GRAVITY, points=3)
    for i, each in enumerate(crushed):
        assert_item_is_shape(batch, i, solve(helix_rod(), each, GRAVITY, throw=False))
    assert batch.converged.tolist() == [True, False, True, False, True]
    for array in batch.arrays.values():
        assert np.isnan(array[~batch.converged]).all()
        assert np.isfinite(array[batch.converged]).all()


def test_items_finer_than_allowed_are_so_in_the_batch():
    robots = [rod(Tendon.helical(offset=2e-3, angle=0.0, turns=turns)) for turns in (2e5, 1.0)]
    batch = solve_batch(robots, 0.5)
    assert batch.status.tolist() == [Status.TOO_FINE, Status.CONVERGED]
    assert np.isnan(batch.tip[0]).all()
    assert batch.counts == {Status.CONVERGED: 1, Status.TOO_FINE: 1}


def test_an_item_that_needs_more_room_than_a_thread_keeps(monkeypatch):
    monkeypatch.setattr(batch_work, "ROOM", 30)
    batch = solve_batch(prototype(1), [0.2, 0.7], GRAVITY, accuracy=[1e-6, 1e-11])
    for i, (tension, accuracy) in enumerate([(0.2, 1e-6), (0.7, 1e-11)]):
        assert_item_is_shape(batch, i, solve(prototype(1), tension, GRAVITY, accuracy=accuracy))


def test_fixed_steps_have_no_estimate():
    batch = solve_batch(prototype(1), [0.0, 0.7], [[0.0, 0.0, 0.0], GRAVITY], steps=40)
    for i, (tension, gravity) in enumerate([(0.0, (0.0, 0.0, 0.0)), (0.7, GRAVITY)]):
        assert_item_is_shape(batch, i, solve(prototype(1), tension, gravity, steps=40))
    assert np.array_equal(batch.error_estimate, [0.0, NAN], equal_nan=True)


def test_prepared_problems_are_those_of_the_single_solve():
    robots = [prototype(i) for i in (1, 2, 3, 4)] * 5
    loads = random_loads(20, 1)
    inputs = Inputs(robots, loads, None, {})
    problems, tensions = inputs.problems(slice(3, 20)), inputs.tensions(slice(3, 20))
    for i in range(3, 20):
        alone = prepare(robots[i], **item(loads, i))
        assert isinstance(alone, Solution)
        assert np.array_equal(problems[i - 3], alone.problem)
        assert np.array_equal(tensions[i - 3], alone.tendons[:, 6])
        assert np.array_equal(inputs.rods[inputs.which[i]], alone.rod)
        assert np.array_equal(inputs.routing[inputs.which[i]], alone.tendons[:, :6])


def test_one_thread_is_many_threads_bit_for_bit():
    loads = random_loads(300, 3)
    one, many = (solve_batch(helix_rod(), **loads, points=4, threads=n) for n in (1, 5))
    assert np.array_equal(one.code, many.code)
    for name in one.arrays:
        assert np.array_equal(getattr(one, name), getattr(many, name), equal_nan=True)


def test_robots_may_differ_from_item_to_item():
    robots, tensions = [prototype(i) for i in (1, 2, 3, 4)], [0.1, 0.2, 0.3, 0.4]
    batch = solve_batch(robots, tensions, GRAVITY, points=3)
    for i in range(4):
        assert_item_is_shape(batch, i, solve(robots[i], tensions[i], GRAVITY))


def test_robots_that_the_compiled_loop_does_not_know_are_solved_one_by_one(monkeypatch):
    monkeypatch.setattr(Inputs, "fits_the_loop", False)
    loads = random_loads(20, 1)
    batch = solve_batch(prototype(2), **loads, points=3)
    for i in range(20):
        assert_item_is_shape(batch, i, solve(prototype(2), **item(loads, i), throw=False))


def test_whatever_else_solve_takes_holds_for_all_items():
    tensions, start = [0.65, 0.75], solve(prototype(1), 0.7, GRAVITY)
    batch = solve_batch(prototype(1), tensions, GRAVITY, start=start)
    for i, tension in enumerate(tensions):
        assert_item_is_shape(batch, i, solve(prototype(1), tension, GRAVITY, start=start))
    with pytest.raises(InvalidInput, match="start"):
        solve_batch(prototype(1), tensions, start="yesterday")
    with pytest.raises(TypeError, match="colour"):
        solve_batch(prototype(1), tensions, colour="red")


@pytest.mark.parametrize(
    ("inputs", "size"),
    [
        ({}, 1),
        ({"tensions": 0.3}, 1),
        ({"tensions": [0.3]}, 1),
        ({"tensions": np.full(4, 0.3)}, 4),
        ({"tensions": np.full((4, 1), 0.3)}, 4),
        ({"tensions": [0.3], "gravity": np.tile(GRAVITY, (4, 1))}, 4),
        ({"gravity": [GRAVITY], "insertion": [0.5, 0.6]}, 2),
        ({"rotation": np.zeros(3)}, 3),
        ({"accuracy": (1e-6, 1e-7)}, 2),
        ({"robot": [prototype(1)] * 3, "tensions": 0.3}, 3),
        ({"robot": [prototype(1)], "tensions": [0.3, 0.4]}, 2),
    ],
)
def test_what_has_no_axis_holds_for_all(inputs, size):
    batch = solve_batch(**({"robot": prototype(1)} | inputs))
    assert len(batch) == size
    assert batch.converged.all()
    assert batch.tip.shape == (size, 3)
    assert batch.tip_rotation.shape == (size, 3, 3)


def test_one_axis_of_tensions_of_several_tendons_is_one_item():
    batch = solve_batch(helix_rod(), [0.1, 0.2, 0.3])
    assert len(batch) == 1
    assert np.array_equal(batch.tip[0], solve(helix_rod(), [0.1, 0.2, 0.3]).tip)


@pytest.mark.parametrize(
    ("robot", "inputs"), [(prototype(1), {"tensions": []}), (COLUMN, {"gravity": np.empty((0, 3))})]
)
def test_an_empty_batch_is_a_batch(robot, inputs):
    batch = solve_batch(robot, **inputs, points=4)
    assert len(batch) == 0
    assert batch.position.shape == (0, 4, 3)
    assert batch.status.size == 0
    assert batch.counts == {}
    assert repr(batch) == "Batch(0 items: none)"


def test_only_the_outputs_asked_for_are_made():
    batch = solve_batch(prototype(1), [0.1, 0.2], points=(0.0, 0.5, 1.0), outputs=["centerline"])
    assert batch.arrays.keys() == {"centerline"}
    assert batch.centerline.shape == (2, 3, 3)
    with pytest.raises(InvalidInput, match=r'outputs.*"tip"'):
        _ = batch.tip
    assert solve_batch(prototype(1), 0.1, outputs=()).arrays == {}
    assert solve_batch(prototype(1), 0.1).arrays.keys() == {"tip", "tip_rotation"}


def test_any_item_as_a_whole_shape():
    loads = random_loads(6, 1)
    batch = solve_batch(prototype(3), **loads, points=4)
    assert np.array_equal(batch.shape(4).tip, batch.tip[4])
    assert np.array_equal(batch.shape(-1).position, batch.position[5])
    assert batch.shape(2, s=[0.0]).s.size == 1
    for wrong in (6, -7, 1.5):
        with pytest.raises(InvalidInput, match="i = "):
            batch.shape(wrong)


def test_results_are_read_only_and_can_be_pickled():
    batch = solve_batch(prototype(1), [0.1, 0.2], points=2)
    for each in (batch, pickle.loads(pickle.dumps(batch))):
        for array in (each.code, each.residual, each.steps, each.tip, each.position, each.fractions, each.status):
            assert not array.flags.writeable
        assert np.array_equal(each.shape(1).tip, batch.tip[1])


BAD = [
    ("tensions[17]", {"tensions": [0.1] * 17 + [-0.1]}),
    ("tensions[1]", {"tensions": [0.1, NAN]}),
    ("tensions[2][0]", {"tensions": [[0.1], [0.2], [-1.0]]}),
    ("tensions", {"tensions": -1.0}),
    ("tensions", {"tensions": np.zeros((4, 2))}),
    ("tensions", {"tensions": "much"}),
    ("tensions", {"tensions": None}),
    ("gravity[3][1]", {"gravity": [[0.0, 0.0, 0.0]] * 3 + [[0.0, INF, 0.0]]}),
    ("gravity", {"gravity": np.zeros((4, 2))}),
    ("gravity", {"gravity": 9.81}),
    ("tip_force", {"tip_force": np.zeros(2)}),
    ("insertion[1]", {"insertion": [0.5, 1.01]}),
    ("insertion", {"insertion": -0.1}),
    ("insertion", {"insertion": [[0.5]]}),
    ("rotation[0]", {"rotation": [INF]}),
    ("accuracy[2]", {"accuracy": [1e-6, 1e-6, 0.0]}),
    ("insertion", {"tensions": [0.1] * 3, "insertion": [0.5] * 4}),
    ("robot[1]", {"robot": [prototype(1), "exonav-2"]}),
    ("robot[1]", {"robot": [prototype(1), helix_rod()]}),
    ("robot", {"robot": []}),
    ("robot", {"robot": "exonav-1"}),
    ("steps", {"steps": 0}),
    ("points", {"points": 1}),
    ("points", {"points": []}),
    ("points[1]", {"points": [0.5, 1.1]}),
    ("points", {"outputs": ["position"]}),
    ("outputs", {"outputs": ["shape"]}),
    ("threads", {"threads": 0}),
    ("progress", {"progress": 3}),
    ("stop", {"stop": True}),
]


@pytest.mark.parametrize(("field", "inputs"), BAD, ids=[f"{i}-{field}" for i, (field, _) in enumerate(BAD)])
def test_bad_input_is_named_by_its_place(field, inputs):
    with pytest.raises(InvalidInput) as caught:
        solve_batch(**({"robot": prototype(1)} | inputs))
    assert caught.value.field == field
    assert "\n" not in str(caught.value)


def test_a_length_that_does_not_fit_says_which_it_should():
    with pytest.raises(InvalidInput, match=r"insertion = 4 items: must be one or 3 items, as tensions has"):
        solve_batch(prototype(1), [0.1] * 3, insertion=[0.5] * 4)


def test_progress_grows_to_the_total_in_the_calling_thread():
    seen, here = [], threading.get_ident()

    def progress(done: int, total: int) -> None:
        assert threading.get_ident() == here
        seen.append((done, total))

    force = [[1e-5 * k, 0.0, -0.05 * k] for k in range(40)]  # hard items among them
    solve_batch(COLUMN, tip_force=force, progress=progress)
    counts = [done for done, _ in seen]
    assert counts == sorted(set(counts))
    assert seen[-1] == (40, 40)
    assert len(seen) > 3


@pytest.mark.parametrize("kind", ["event", "function"])
def test_an_early_stop_keeps_what_is_done(kind):
    tensions = np.linspace(0.0, 1.0, 20_000)
    event, seen = threading.Event(), []

    def progress(done: int, total: int) -> None:
        seen.append(done)
        if done > 500:
            event.set()

    batch = solve_batch(
        prototype(1), tensions, GRAVITY, progress=progress, stop=event if kind == "event" else event.is_set
    )
    done = batch.converged
    assert 500 < seen[-1] <= done.sum() < 20_000
    assert batch.counts[Status.NOT_REACHED] == (~done).sum()
    assert np.isnan(batch.tip[~done]).all()
    assert np.isnan(batch.load_factor[~done]).all()
    for i in np.flatnonzero(done)[::200].tolist():
        assert np.array_equal(batch.tip[i], solve(prototype(1), float(tensions[i]), GRAVITY).tip)
    assert "not_reached" in repr(batch)
    assert set(batch.status[~done]) == {Status.NOT_REACHED}


def test_a_batch_stopped_beforehand_does_nothing():
    batch = solve_batch(prototype(1), [0.1, 0.2], stop=lambda: True)
    assert batch.counts == {Status.NOT_REACHED: 2}
    assert np.isfinite(batch.shape(1).tip).all()  # can still be solved alone


def test_an_interrupt_ends_the_batch_at_once_and_all_its_threads():
    before, tensions = threading.active_count(), np.linspace(0.0, 1.0, 200_000)
    solve_batch(prototype(1), 0.1)
    timer = threading.Timer(0.3, _thread.interrupt_main)
    timer.start()
    start = time.monotonic()
    with pytest.raises(KeyboardInterrupt):
        solve_batch(prototype(1), tensions, GRAVITY, accuracy=1e-9)
    assert time.monotonic() - start < 2.0
    timer.join()
    assert threading.active_count() == before


def test_an_error_of_the_progress_function_ends_the_batch():
    with pytest.raises(ZeroDivisionError):
        solve_batch(prototype(1), np.linspace(0.0, 1.0, 5000), progress=lambda done, total: 1 / 0)


def peak(items: int, points: int) -> SimpleNamespace:
    """Memory at most held above that before, and in the outputs, bytes."""
    loads = {"tensions": np.linspace(0.0, 0.5, items), "gravity": GRAVITY, "threads": 2}
    tracemalloc.start()
    batch = solve_batch(prototype(1), **loads, points=points)
    most = tracemalloc.get_traced_memory()[1]
    tracemalloc.stop()
    arrays = (*batch.arrays.values(), batch.code, batch.load_factor, batch.residual, batch.error_estimate, batch.steps)
    return SimpleNamespace(most=most, outputs=sum(each.nbytes for each in arrays))


def test_memory_grows_with_the_outputs_alone():
    """Twice the items add little but their outputs: no states are kept, no table is as long as the batch."""
    solve_batch(prototype(1), 0.1)
    small, large = peak(10_000, 8), peak(20_000, 8)
    assert large.most - small.most < 1.1 * (large.outputs - small.outputs)
    assert large.most < large.outputs + 24e6
