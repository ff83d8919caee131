"""The schema of the messages: one for server and page, strict, and small on the wire."""

import json
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from pydantic import ValidationError

import tendonrod.navigate
from navigate.pretend import PretendSession, scenario
from tendonrod.navigate import asked, told, wire
from tendonrod.navigate.commands import Jog, Rates
from tendonrod.navigate.messages import CLIENT, page_schema

PAGE = Path(tendonrod.navigate.__file__).with_name("web")
GOOD = {
    "acknowledge": {}, "take": {}, "release": {}, "stop": {}, "reset": {}, "replay_stop": {}, "ping": {"id": 3},
    "jog": {"seq": 1, "insertion": 1.0, "rotation": -1, "tension": 0.5, "hold": True},
    "rates": {"insertion": 3e-3, "rotation": 0.5, "tension": 0.1}, "coupling": {"on": False}, "record": {"on": True},
    "place": {"tube": {"height": 0.02, "tilt": 0.3}},
    "replay_set": {"speed": 4.0, "paused": True, "at": 2.5},
    "replay": {"name": "2030-01-31-101500.jsonl", "speed": 2.0},
}  # fmt: skip


def test_the_page_has_the_schema_of_the_server():
    """Made anew by: python -m tendonrod.navigate.messages."""
    assert json.loads((PAGE / "messages.json").read_text(encoding="utf-8")) == page_schema()


def test_every_message_of_a_client_is_understood():
    assert set(GOOD) == set(CLIENT.json_schema()["discriminator"]["mapping"])
    for kind, what in GOOD.items():
        assert CLIENT.validate_json(json.dumps({"type": kind, **what})).type == kind


@pytest.mark.parametrize("kind", GOOD)
def test_unknown_and_missing_fields_are_refused(kind):
    with pytest.raises(ValidationError):
        CLIENT.validate_json(json.dumps({"type": kind, **GOOD[kind], "unknown": 1}))
    needed = [name for name in GOOD[kind] if kind != "replay_set" and name != "speed"]
    for name in needed:
        with pytest.raises(ValidationError):
            CLIENT.validate_json(json.dumps({"type": kind, **{key: GOOD[kind][key] for key in needed if key != name}}))


@pytest.mark.parametrize("value", ["NaN", "Infinity", "-Infinity", "1e400", '"0.5"', "true", "null", "[0.5]", "1.0001"])
@pytest.mark.parametrize("field", ["insertion", "rotation", "tension"])
def test_a_deflection_is_a_number_from_minus_one_to_one(field, value):
    text = json.dumps({"type": "jog", **GOOD["jog"], field: "HERE"}).replace('"HERE"', value)
    with pytest.raises(ValidationError):
        CLIENT.validate_json(text)


def test_rates_have_the_same_bounds_on_the_wire_as_inside():
    for name, ends in Rates.allowed().items():
        for value in ends:
            asked.SomeRates(**{**GOOD["rates"], name: value})
        for value in (0.99 * ends[0], 1.01 * ends[1]):
            with pytest.raises(ValidationError):
                asked.SomeRates(**{**GOOD["rates"], name: value})


def moved():
    return PretendSession().step(Jog(insertion=0.01, rotation=0.3, tension=0.1), 2.0)


def test_scene_and_state_fit_the_schema_and_keep_the_numbers():
    snapshot = moved()
    state = told.State.model_validate_json(wire.state(snapshot, moving=True, mode="live", recording="a.jsonl"))
    assert state.insertion == pytest.approx(snapshot.insertion, abs=1e-7)
    np.testing.assert_allclose(state.centerline, snapshot.centerline, atol=1e-7)
    assert state.clearance["canal"] == [None] * len(snapshot.centerline)  # where it is infinite
    assert state.gauges["contact_force"].high is None
    told.Scene.model_validate_json(json.dumps(wire.scene(scenario(), snapshot.limits)))


def test_the_state_stays_small_and_shows_the_strongest_contacts():
    """500 points, 200 contacts, 6 structures, 36 targets."""
    rng = np.random.default_rng(1)
    line = rng.normal(0.0, 0.05, (500, 3))
    force = rng.normal(0.0, 1e-2, (200, 3))
    rough = replace(
        moved(), centerline=line, pressure=rng.uniform(0.0, 5e3, 500),
        clearance={name: rng.uniform(0.0, 1e-2, 500) for name in ("cord", "dura", "bone", "roots")},
        contact_point=line[:200], contact_force=force, contact_pressure=rng.uniform(0.0, 5e3, 200),
        contact_structure=("cord",) * 200,
        target_distance={f"lateral-left@T{k}": float(rng.uniform(0.0, 0.1)) for k in range(36)},
    )  # fmt: skip
    text = wire.state(rough, moving=True, mode="live", recording=None)
    state = told.State.model_validate_json(text)
    assert len(text) < 12_000
    assert len(state.centerline) == told.MOST_POINTS == len(state.clearance["cord"])
    np.testing.assert_allclose([state.centerline[0], state.centerline[-1]], line[[0, -1]], atol=1e-7)
    shown = np.linalg.norm([each.force for each in state.contacts], axis=1)
    everything = np.sort(np.linalg.norm(force, axis=1))
    np.testing.assert_allclose(np.sort(shown), everything[-told.MOST_CONTACTS :], atol=2e-6)


def test_a_mesh_of_no_faces_is_an_empty_stl():
    assert len(wire.stl((np.zeros((0, 3)), np.zeros((0, 3), dtype=int)), "nothing")) == 84
