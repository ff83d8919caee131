"""The contact oracles themselves: beam theory, first integrals of the elastica, and one against the other."""

from dataclasses import replace

import numpy as np
import pytest

from contact_energy import EnergyRod, above_plane, inside_tube, least_energy
from contact_oracles import PlanarRod, channel_contact, equilibrium, floor_contact

L, EI = 0.1, 1e-3  # m, N m2
SHALLOW = 1e-5  # m, gap whose slopes of 1e-4 leave beam theory wrong by 1e-8


def only(shape, kind: str):
    (touch,) = shape.touches
    assert touch.kind == kind
    return touch


def test_shallow_floor_touches_where_beam_theory_says():
    unit = EI * SHALLOW / L**4
    assert floor_contact(L, EI, 7.99 * unit, SHALLOW).touches == ()
    assert only(floor_contact(L, EI, 8.01 * unit, SHALLOW), "tip").force < 0.001 * 8 * unit * L
    only(floor_contact(L, EI, 71.9 * unit, SHALLOW), "tip")
    only(floor_contact(L, EI, 72.1 * unit, SHALLOW), "flat")


def test_shallow_tip_touch_has_the_force_of_beam_theory():
    q = 30 * EI * SHALLOW / L**4
    shape = floor_contact(L, EI, q, SHALLOW)
    force = 3 / 8 * q * L - 3 * EI * SHALLOW / L**3
    np.testing.assert_allclose(only(shape, "tip").force, force, rtol=1e-6)
    np.testing.assert_allclose(shape.base_moment, q * L**2 / 2 - force * L, rtol=1e-6)


def test_shallow_flat_rod_lies_where_beam_theory_says():
    q = 300 * EI * SHALLOW / L**4
    shape, a = floor_contact(L, EI, q, SHALLOW), (72 * EI * SHALLOW / q) ** 0.25
    touch = only(shape, "flat")
    np.testing.assert_allclose(touch.s, a, rtol=1e-6)
    np.testing.assert_allclose(shape.contact_length, L - a, rtol=1e-6)
    np.testing.assert_allclose(touch.force, q * a / 3, rtol=1e-6)
    np.testing.assert_allclose(shape.base_moment, q * a**2 / 6, rtol=1e-6)
    s = np.linspace(0, a, 9)
    w = q / (24 * EI) * (s**4 - 8 / 3 * a * s**3 + 2 * a**2 * s**2)
    np.testing.assert_allclose(shape.at(s)["x"], w, rtol=0, atol=1e-6 * SHALLOW)


@pytest.mark.parametrize("gap", [0.01, 0.05])
def test_deep_floor_keeps_the_first_integral_of_the_elastica(gap):
    """M^2 / 2EI + n_x sin(theta) + q x is the same along the rod; flat, the base moment is sqrt(2 EI q gap) exactly."""
    for load in (30, 150):
        q = load * EI * gap / L**4
        shape = floor_contact(L, EI, q, gap)
        (touch,) = shape.touches
        end = shape.at(np.array([0.0, L]))
        np.testing.assert_allclose(end["x"][1], gap, rtol=1e-11)
        tip = -touch.force * np.sin(end["theta"][1]) if touch.kind == "tip" else 0.0
        np.testing.assert_allclose(shape.base_moment, np.sqrt(2 * EI * (tip + q * gap)), rtol=1e-9)
        np.testing.assert_allclose(shape.base_force, [q * (L - shape.contact_length) - touch.force, 0.0], atol=1e-12)


def test_shear_spreads_the_flat_rod_s_reaction_and_vanishes_with_the_compliance():
    q, gap = 10.0, 0.005
    stiff = floor_contact(L, EI, q, gap)
    moved = [floor_contact(L, EI, q, gap, GA=GA, EA=2.6 * GA).touches[0].s - stiff.touches[0].s for GA in (1e4, 4e4)]
    assert 1e-7 < abs(moved[1]) < abs(moved[0]) < 1e-2
    np.testing.assert_allclose(moved[0] / moved[1], 2.0, rtol=0.1)  # with the reach sqrt(EI / GA)


def test_precurved_tip_in_a_narrow_channel_has_the_force_of_beam_theory():
    for curvature in (3 * SHALLOW / L**2, 30 * SHALLOW / L**2):
        shape = channel_contact(L, EI, curvature, SHALLOW)
        force = 3 * EI * (curvature * L**2 / 2 - SHALLOW) / L**3
        np.testing.assert_allclose(only(shape, "tip").force, force, rtol=1e-6)
    assert channel_contact(L, EI, 1.9 * SHALLOW / L**2, SHALLOW).touches == ()


def test_precurved_rod_touches_the_other_wall_where_beam_theory_says():
    """With the tip alone on its wall, the rod's lowest point reaches the other wall as a cubic says."""
    s = np.linspace(0, L, 100_001)

    def lowest(k: float) -> float:
        return float(np.min(k * s**2 / 2 - 1.5 * (k / 2 - SHALLOW / L**2) * (s**2 - s**3 / (3 * L))))

    low, high = 20 * SHALLOW / L**2, 80 * SHALLOW / L**2
    for _ in range(50):
        middle = 0.5 * (low + high)
        low, high = (middle, high) if lowest(middle) > -SHALLOW else (low, middle)
    only(channel_contact(L, EI, 0.999 * low, SHALLOW), "tip")
    touches = channel_contact(L, EI, 1.001 * low, SHALLOW).touches
    assert [(each.kind, each.side) for each in touches] == [("point", -1), ("tip", 1)]


@pytest.mark.parametrize("curvature", [4.0, 12.0, 30.0])
def test_precurved_rod_in_a_wide_channel_keeps_the_first_integral(curvature):
    """M^2 / 2EI + M curvature + n_x sin(theta) is the same along the rod without line load."""
    shape = channel_contact(L, EI, curvature, 0.002)
    s = np.linspace(0, L, 41)
    at, n_x = shape.at(s), np.zeros(s.size)
    for each in shape.touches:
        n_x -= each.side * each.force * (s < each.s if each.kind == "point" else s <= each.s)
    integral = at["moment"] ** 2 / (2 * EI) + at["moment"] * curvature + n_x * np.sin(at["theta"])
    np.testing.assert_allclose(integral, integral[0], rtol=1e-9)
    assert np.abs(at["x"]).max() < 0.002 + 1e-9
    assert all(each.force > 0 for each in shape.touches)


def test_mirrored_channel_mirrors_the_shape():
    rod = PlanarRod(
        length=L,
        EI=EI,
        EA=3e3,
        GA=1e3,
        curvature=20.0,
        line=(0.3, 0.1),
        tip_force=(0.02, -0.05),
        lower=-3e-3,
        upper=1e-3,
    )
    mirror = replace(rod, curvature=-20.0, line=(-0.3, 0.1), tip_force=(-0.02, -0.05), lower=-1e-3, upper=3e-3)
    s = np.linspace(0, L, 9)
    a, b = equilibrium(rod).at(s), equilibrium(mirror).at(s)
    np.testing.assert_allclose(a["x"], -b["x"], rtol=0, atol=1e-11)
    np.testing.assert_allclose(a["z"], b["z"], rtol=0, atol=1e-11)


FLOOR = {"length": L, "Kbt": (EI, EI, EI), "gap": above_plane(0.01)}
CASES = {
    "tip on the floor": (EnergyRod(**FLOOR, line=(2.0, 0, 0), free=(1,)), floor_contact(L, EI, 2.0, 0.01)),
    "flat on the floor": (EnergyRod(**FLOOR, line=(10.0, 0, 0), free=(1,)), floor_contact(L, EI, 10.0, 0.01)),
    "tip in the tube": (
        EnergyRod(length=L, Kbt=(EI, EI, 0.77 * EI), u_star=(0, 4.0, 0), gap=inside_tube(0.002)),
        channel_contact(L, EI, 4.0, 0.002),
    ),
    "stretched and sheared": (
        EnergyRod(
            length=L, Kbt=(EI, EI, EI), Kse=(300, 300, 800), u_star=(0, 4.0, 0), line=(1.0, 0, 2.0),
            tip_force=(0.05, 0, -0.1), gap=inside_tube(0.002), free=(1,),
        ),
        channel_contact(L, EI, 4.0, 0.002, GA=300, EA=800, line=(1.0, 2.0), tip_force=(0.05, -0.1)),
    ),
}  # fmt: skip


@pytest.mark.parametrize(("rod", "exact"), CASES.values(), ids=CASES.keys())
def test_least_energy_comes_to_the_exact_planar_shape_at_second_order(rod, exact):
    wrong = []
    for elements in (20, 40):
        shape = least_energy(rod, elements)
        at = exact.at(shape.s)
        wrong.append(np.abs(shape.p - np.stack([at["x"], 0 * at["x"], at["z"]], axis=1)).max())
        carried = sum(each.force for each in exact.touches) + rod.line[0] * exact.contact_length
        np.testing.assert_allclose(shape.force.sum(), carried, rtol=0.5 / elements)
    assert wrong[1] < 1e-5
    assert wrong[0] / wrong[1] > 3.0


def test_least_energy_finds_the_touch_on_the_other_wall():
    exact = channel_contact(L, EI, 12.0, 0.002)
    shape = least_energy(
        EnergyRod(length=L, Kbt=(EI, EI, EI), u_star=(0, 12.0, 0), gap=inside_tube(0.002), free=(1,)), 60
    )
    np.testing.assert_allclose(shape.p[:, 0], exact.at(shape.s)["x"], rtol=0, atol=1e-5)
    (first, last), on = exact.touches, shape.force > 0
    np.testing.assert_allclose(shape.s[on][[0, -1]], [first.s, last.s], atol=L / 60)
    np.testing.assert_allclose(shape.force[on][-1], last.force, rtol=0.03)


def test_free_rod_is_the_helix_of_its_precurvature_at_second_order():
    u = np.array([0.0, 10.0, 20.0])
    pitch = np.linalg.norm(u)
    axis, angle = u / pitch, pitch * L
    z = np.array([0.0, 0.0, 1.0])
    tip = (
        np.sin(angle) / pitch * z
        + (1 - np.cos(angle)) / pitch * np.cross(axis, z)
        + (L - np.sin(angle) / pitch) * axis * axis[2]
    )
    wrong = [
        np.linalg.norm(least_energy(EnergyRod(length=L, Kbt=(EI, EI, EI), u_star=u), n).p[-1] - tip) for n in (20, 40)
    ]
    assert wrong[1] < 2e-5
    np.testing.assert_allclose(wrong[0] / wrong[1], 4.0, rtol=0.05)


HELIX = EnergyRod(
    length=L, Kbt=(EI, EI, 0.77 * EI), u_star=(0, 25.0, 20.0), line=(0.05, 0.1, 0), tip_force=(0, 0.02, -0.02),
    gap=inside_tube(0.003),
)  # fmt: skip


def test_helix_in_a_tube_is_balanced_and_converges_with_the_mesh():
    coarse, fine = least_energy(HELIX, 20), least_energy(HELIX, 40)
    assert np.abs(coarse.p - fine.p[::2]).max() < 1e-4
    for shape in (coarse, fine):
        assert shape.gap[1:].min() > -1e-10
        assert np.all(shape.force[1:][shape.gap[1:] > 1e-9] == 0.0)
        # what bends the first element is all that acts beyond its middle
        h = L / (shape.s.size - 1)
        nodal = np.tile(np.array(HELIX.line) * h, (shape.s.size, 1))
        nodal[-1] = 0.5 * nodal[-1] + HELIX.tip_force
        nodal += shape.force[:, None] * shape.normal
        middle = 0.5 * (shape.p[0] + shape.p[1])
        moment = np.cross(shape.p[1:] - middle, nodal[1:]).sum(axis=0)
        moment = 0.5 * (np.eye(3) + shape.R[1].T) @ moment  # in the frame of the middle
        internal = np.array(HELIX.Kbt) * (shape.u[0] - HELIX.u_star)
        np.testing.assert_allclose(internal, moment, rtol=0, atol=0.01 * np.abs(moment).max())


def test_helix_of_the_other_hand_is_the_mirror_image():
    mirror = replace(HELIX, u_star=(0, 25.0, -20.0), line=(0.05, -0.1, 0), tip_force=(0, -0.02, -0.02))
    a, b = least_energy(HELIX, 20), least_energy(mirror, 20)
    np.testing.assert_allclose(b.p, a.p * [1, -1, 1], rtol=0, atol=1e-9)
    np.testing.assert_allclose(b.force, a.force, rtol=0, atol=1e-7)
