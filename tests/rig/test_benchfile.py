"""Bench files: every number of a bench under a key with its unit, errors in the words of the file."""

from dataclasses import fields, replace
from math import radians
from pathlib import Path

import pytest

from rig.short_trials import DOWN, FAST_FILE, robot, setup
from tendonrod.errors import InvalidInput
from tendonrod.rig import benchfile_tables as tables
from tendonrod.rig.benches import DeviceSource, VirtualSource
from tendonrod.rig.benchfile import default_bench, read_bench
from tendonrod.rig.benchfile_units import flat, in_file_units, in_unit, to_si
from tendonrod.rig.limits import Limits
from tendonrod.rig.virtual.injection import Injection, InjectionKind
from tendonrod.rig.virtual.setup import AxisModel, LoadCellModel, TrackerModel, VirtualSetup

EXAMPLES = Path(__file__).parents[2] / "examples"
VIRTUAL = '[bench]\nkind = "virtual"\n'
DEVICES = """[bench]
kind = "devices"
[launchpad]
port = "/dev/ttyACM0"
[load_cell]
counts_per_newton = 1349
zero_counts = 32768
full_scale_n = 22.24
"""
FULL = """[bench]
kind = "virtual"
gravity_m_s2 = [0, 0, 9.81]
mechanics = "engine"
command_timeout_ms = 150
highest_tension_n = 1.2
[tendon]
stiffness_n = 500
length_mm = 250
friction = 0.2
slack_mm = -0.5
[outer_tube]
friction_n = 0.1
tilt_deg = [1, -2]
[screw]
speed_mm_s = 0.4
acceleration_mm_s2 = 4
braking_mm_s2 = 40
backlash_mm = 0.01
pressed = "free"
resolution_mm = 0.002
home_error_mm = 0.02
low_mm = -20
high_mm = 90
start_mm = 1
[rotation]
speed_deg_s = 90
backlash_deg = 2
[load_cell]
noise_mn = 7
drift_mn_per_sqrt_s = 0.2
bandwidth_hz = 50
[tracker]
name = "sensor"
delay_ms = [20, 40]
mass_g = 0.3
turn_deg = [0, 0, 90]
[field]
position_mm = [10, 20, 30]
[[fault]]
kind = "axis runs away"
where = "rotation"
time_s = 3
duration_s = 0.5
value_deg_s = 30
[limits]
tension_n = 0.8
screw_travel_mm = [-10, 80]
"""


@pytest.fixture
def written(tmp_path):
    def write(text):
        path = tmp_path / "bench.toml"
        path.write_text(text, encoding="utf-8")
        return path

    return write


def source(path):
    file = read_bench(path)
    return file.source(robot(), file.gravity or DOWN)


def test_a_file_that_says_nothing_is_the_default_bench(written):
    plain = VirtualSource(setup=VirtualSetup(robot=robot(), gravity=DOWN))
    assert default_bench().source(robot(), DOWN) == plain == source(written(VIRTUAL))
    assert read_bench(written(VIRTUAL)).gravity is None


def test_every_key_reaches_its_number_in_si(written):
    file = read_bench(written(FULL))
    assert file.gravity == (0.0, 0.0, 9.81)
    found = file.source(robot(), DOWN)
    assert isinstance(found, VirtualSource)
    made, screw = found.setup, found.setup.screw
    assert (made.mechanics, made.command_timeout, made.highest_tension) == ("engine", 0.15, 1.2)
    assert (made.tendon_stiffness, made.tendon_length, made.tendon_friction, made.slack) == (500.0, 0.25, 0.2, -5e-4)
    assert (made.outer_friction, made.exit_tilt) == (0.1, (radians(1.0), radians(-2.0)))
    assert screw == AxisModel(
        speed=0.4e-3, acceleration=4e-3, braking=40e-3, backlash=1e-5, pressed="free", resolution=2e-6,
        home_error=2e-5, low=-20e-3, high=90e-3, start=1e-3,
    )  # fmt: skip
    default = VirtualSetup(robot=robot())
    assert made.rotation == replace(default.rotation, speed=radians(90.0), backlash=radians(2.0))
    assert made.load_cell == LoadCellModel(noise=7e-3, drift=2e-4, bandwidth=50.0)
    field = ((1.0, 0.0, 0.0, 0.01), (0.0, 1.0, 0.0, 0.02), (0.0, 0.0, 1.0, 0.03), (0.0, 0.0, 0.0, 1.0))
    sensor = TrackerModel(name="sensor", delay=(0.02, 0.04), mass=3e-4, turn=(0, 0, radians(90)), T_world_field=field)
    assert made.tracker == sensor
    runaway = Injection(
        kind=InjectionKind.RUNAWAY, where="rotation", time=3.0, duration=0.5, value=radians(30.0)
    )  # fmt: skip
    assert made.injections == (runaway,)
    assert dict(found.limits) == {"tension": 0.8, "screw": {"low": -0.01, "high": 0.08}}


def test_a_bench_may_have_no_tracker(written):
    assert source(written(VIRTUAL + "tracker = false\n")).trackers == ()
    assert source(written(FAST_FILE)) == VirtualSource(setup=setup())


@pytest.mark.parametrize(
    ("table", "model", "beside"),
    [
        (tables.LinearTable, AxisModel, ()),
        (tables.RotaryTable, AxisModel, ()),
        (tables.VirtualCellTable, LoadCellModel, ()),
        (tables.VirtualTrackerTable, TrackerModel, ("T_world_field",)),
    ],
)
def test_no_number_of_a_bench_lacks_its_key(table, model, beside):
    assert {flat(key) for key in table.model_fields} == {each.name for each in fields(model)} - set(beside)


def test_no_plain_limit_lacks_its_key():
    beside = {"period", "length", "full_scale", "speed_margin", "overrun", "jump", "lag"}  # of devices and the loop
    numbers = {each.name for each in fields(Limits) if isinstance(each.default, (int, float))}
    assert numbers - beside <= {flat(key) for key in tables.LimitsTable.model_fields}


def test_devices_with_their_tools(written, tmp_path):
    (tmp_path / "tip.rom").write_bytes(b"NDI\0" + bytes(100))
    more = """tare_readings = 50
[aurora]
port = "tcp://tracker:8765"
delay_ms = 12
largest_error_mm = 2
[[tool]]
name = "tip"
rom = "tip.rom"
offset_mm = [1, 0, 0]
mass_g = 0.2
[[tool]]
name = "0B"
on = "base"
[field]
rotation_deg = [0, 0, 180]
"""
    found = source(written(DEVICES.replace("/dev/ttyACM0", "/dev/x") + more))
    assert isinstance(found, DeviceSource)
    assert found.launchpad == {"port": "/dev/x"}
    tools = {"tip": str(tmp_path / "tip.rom"), "0B": None}
    told = {"port": "tcp://tracker:8765", "delay": 0.012, "largest_error": 0.002, "tools": tools}
    assert found.aurora == told
    assert (found.tare_readings, found.calibration.counts_per_newton) == (50, 1349.0)
    assert [(each.name, each.on, each.mass, each.offset) for each in found.trackers] == [
        ("tip", "robot", 2e-4, (1e-3, 0.0, 0.0)),
        ("0B", "base", 0.0, (0.0, 0.0, 0.0)),
    ]
    assert found.T_world_field is not None
    assert found.T_world_field[0][0] == pytest.approx(-1.0)


@pytest.mark.parametrize(
    ("text", "said"),
    [
        ("", "= empty: must be [bench] with kind"),
        ("[bench", "line 1 = [bench: must be valid TOML"),
        ("[tendon]\n", ": bench = missing: must be a table, [bench]"),
        ("[bench]\n", ": bench.kind = missing: must be one of virtual, devices"),
        ('[bench]\nkind = "simulink"\n', ": bench.kind = 'simulink': must be one of virtual, devices"),
        (VIRTUAL + "tracker = 1\n", ": bench.tracker = 1: must be true or false"),
        (VIRTUAL + "gravity_m_s2 = [1, 2]\n", ": bench.gravity_m_s2 = [1.0, 2.0]: must be a vector of 3 finite"),
        (VIRTUAL + 'mechanics = "x"\n', ": bench.mechanics = 'x': must be one of table, engine"),
        (VIRTUAL + "[screw]\nspeed_mm_s = -1\n", ": screw.speed_mm_s = -1.0: must be > 0"),
        (VIRTUAL + "[screw]\nspeed = 1\n", ": screw.speed = 1: must be one of the keys of [screw]: speed_mm_s, "),
        (VIRTUAL + '[screw]\nspeed_mm_s = "1"\n', ": screw.speed_mm_s = '1': must be a finite number"),
        (VIRTUAL + "[screw]\nlow_mm = 5\nhigh_mm = 3\n", ": screw.low_mm = 5.0: must be < high_mm = 3.0"),
        (VIRTUAL + "[screw]\npressed = 1\n", ": screw.pressed = 1: must be a text in quotes"),
        (VIRTUAL + "[tendon]\nlength_mm = 10\n", ": tendon.length_mm = 10.0: must be > 75.4434 mm"),
        (VIRTUAL + "[outer_tube]\ntilt_deg = [1]\n", ": outer_tube.tilt_deg = [1.0]: must be a vector of 2 finite"),
        (VIRTUAL + "[tracker]\ndelay_ms = [2, 1]\n", ": tracker.delay_ms = [2.0, 1.0]: must be two times"),
        (VIRTUAL + "[limits]\nslack_n = 2\n", ": limits.slack_n = 2.0: must be below soft * tension = 0.9"),
        (VIRTUAL + "[limits]\ntension_n = 50\n", ": limits.tension_n = 50.0: must be below 21.8 N, 98 % of the load"),
        (
            VIRTUAL + "[load_cell]\nfull_scale_n = 2\n[limits]\ntension_n = 2\n",
            ": limits.tension_n = 2.0: must be below 1.96",
        ),
        (VIRTUAL + "[limits]\nlate_in_row = 0.5\n", ": limits.late_in_row = 0.5: must be a whole number"),
        (VIRTUAL + "[limits]\nscrew_travel_mm = [1, 0]\n", ": limits.screw_travel_mm = [1.0, 0.0]: must be its low"),
        (VIRTUAL + '[[fault]]\nkind = "boo"\ntime_s = 1\n', ": fault[0].kind = 'boo': must be one of load cell gives"),
        (
            VIRTUAL + '[[fault]]\nkind = "axis stalls"\ntime_s = 1\n',
            ": fault[0].where = missing: must be one of screw, translation, rotation",
        ),
        (
            VIRTUAL + '[[fault]]\nkind = "encoder jumps"\nwhere = "screw"\nvalue_deg = 1\ntime_s = 1\n',
            ": fault[0].value_deg = 1.0: must be left out: 'encoder jumps' takes value_mm",
        ),
        (
            VIRTUAL + '[[fault]]\nkind = "encoder jumps"\nwhere = "rotation"\ntime_s = 1\n',
            ": fault[0].value_deg = missing: must be given for encoder jumps",
        ),
        *(
            (
                VIRTUAL + f'[[fault]]\nkind = "cell dropout"\n{time}at_s = 1\n',
                ": fault[0].at_s = 1: must be one of the keys of [fault[0]]: kind, time_s, ",
            )
            for time in ("time_s = 2\n", "")
        ),
        (DEVICES + '[[tool]]\nname = "tip"\nsize = 1\n', ": tool[0].size = 1: must be one of the keys of [tool[0]]: "),
        ('[bench]\nkind = "devices"\n', ": launchpad = missing: must be given"),
        (DEVICES + "tare_readings = -1\n", ": load_cell.tare_readings = -1: must be a whole number from 0"),
        (DEVICES + "[tendon]\nfriction = 1\n", ": tendon = {'friction': 1}: must be one of the keys at the top"),
        *(
            (DEVICES.replace("[load_cell]", f"{key} = {value}\n[load_cell]"), f": launchpad.{key} = {value}: must be")
            for key, value in (("timeout_ms", "-5.0"), ("tries", "0"), ("baud", "-1"), ("max_age_ms", "-3.0"))
        ),
        *(
            (
                DEVICES + f'[aurora]\nport = "/dev/x"\n{key} = {value}\n[[tool]]\nname = "tip"\n',
                f": aurora.{key} = {value}: must be",
            )
            for key, value in (("rate_hz", "-4.0"), ("limit_ms", "0.0"), ("baud", "5"), ("largest_error_mm", "-1.0"))
        ),
        (DEVICES.replace("/dev/ttyACM0", ""), ": launchpad.port = ''"),
        (DEVICES + '[aurora]\nport = "tcp://h:70000"\n[[tool]]\nname = "tip"\n', ": aurora.port = 'tcp://h:70000'"),
        (DEVICES + '[aurora]\nport = "/dev/x"\n', ": tool = missing: must be given, [[tool]] for each tool"),
        (DEVICES + '[[tool]]\nname = "tip"\n', ": aurora = missing: must be given where there is a [[tool]]"),
        (
            DEVICES + '[aurora]\nport = "/dev/x"\n[[tool]]\nname = "tip"\nrom = "none.rom"\n',
            "none.rom': must be a tool definition file (.rom) that can be read",
        ),
        (
            DEVICES + '[aurora]\nport = "/dev/x"\n[[tool]]\nname = "tip"\nmass_g = -1\n',
            ": tool[0].mass_g = -1.0: must be >= 0",
        ),
        (
            DEVICES + '[aurora]\nport = "/dev/x"\n' + 2 * '[[tool]]\nname = "tip"\n',
            ": tool = ['tip', 'tip']: must be of different names",
        ),
    ],
)
def test_errors_name_file_key_value_and_what_is_allowed(written, text, said):
    path = written(text)
    with pytest.raises(InvalidInput) as error:
        source(path)
    assert str(error.value).startswith(str(path))
    assert said in str(error.value)
    assert "\n" not in str(error.value)


@pytest.mark.parametrize("kind", ["virtual", "device"])
def test_the_example_files_are_read(kind):
    found = source(EXAMPLES / f"{kind}-bench.toml")
    assert isinstance(found, VirtualSource if kind == "virtual" else DeviceSource)
    if isinstance(found, VirtualSource):
        given = replace(VirtualSetup(robot=robot()), gravity=DOWN)
        assert found.setup.screw == given.screw
        assert found.setup.translation == given.translation
        assert found.setup.load_cell == given.load_cell
        assert found.setup.rotation.speed == pytest.approx(given.rotation.speed, rel=5e-3)
        assert found.setup.rotation.braking == pytest.approx(given.rotation.braking, rel=5e-3)


def test_the_example_of_a_virtual_bench_has_every_key():
    read = read_bench(EXAMPLES / "virtual-bench.toml").table
    some = ("fault", "limits", "field")  # what a bench need not have
    for name in set(type(read).model_fields) - set(some):
        table = getattr(read, name)
        assert {key for key in type(table).model_fields if getattr(table, key) is None} == set(), name


@pytest.mark.parametrize(
    ("field", "value", "said"),
    [
        ("tracker.mass", 5e-4, ("tracker.mass_g", 0.5)),
        ("screw.backlash", 2e-5, ("screw.backlash_mm", 0.02)),
        ("slack", -1e-3, ("tendon.slack_mm", -1.0)),
        ("exit_tilt", [radians(0.5), 0.0], ("outer_tube.tilt_deg", [0.5, 0.0])),
        ("outer_friction", 0.05, ("outer_tube.friction_n", 0.05)),
        ("tendon_friction", 0.1, ("tendon.friction", 0.1)),
        ("command_timeout", 0.1, ("bench.command_timeout_ms", 100.0)),
        ("mechanics", "engine", ("bench.mechanics", "engine")),
        ("rotation.speed", radians(115.0), ("rotation.speed_deg_s", 115.0)),
    ],
)
def test_fields_of_a_setup_are_said_as_the_file_says_them(field, value, said):
    assert in_file_units(field, value) == said
    assert to_si(*said) == pytest.approx(value) if not isinstance(value, str) else to_si(*said) == value


@pytest.mark.parametrize(
    ("key", "allowed", "said"),
    [
        ("launchpad.timeout_ms", "from 0.001 to 1", "from 1 to 1000"),
        ("tendon.length_mm", "> 0.0754434 m, its path in the robot", "> 75.4434 mm, its path in the robot"),
        ("limits.release_rate_mm_s", "at most screw.speed = 0.003", "at most screw.speed = 3"),
        ("screw.low_mm", "< high_mm = 30.0", "< high_mm = 30.0"),  # the file's own words already
        ("limits.late_share", "from 1 to 100", "from 1 to 100"),
        ("limits.tension_n", "> 0", "> 0"),
    ],
)
def test_what_is_allowed_is_said_in_the_keys_unit(key, allowed, said):
    assert in_unit(key, allowed) == said
