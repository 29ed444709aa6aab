"""Assemblies against matrices written by hand, constraints and whole structures."""

from typing import cast

import numpy as np
import pytest
import scipy.sparse as sp
from hypothesis import given
from hypothesis import strategies as st
from numpy.testing import assert_allclose, assert_array_equal

import halfdof_ctrl as hd
import halfdof_ctrl.nonlinear.reduction  # registers what nlmechss asks
from halfdof_ctrl.base.errors import AssemblyError, ParameterError, SignalNameError
from halfdof_ctrl.base.sparse_arrays import as_sparse
from halfdof_ctrl.model.nonlinear import NonlinearModel
from halfdof_ctrl.parts.joints import AnyJoint

BY_HAND = 1e-14  # the same sums in another order
SOLVED = 1e-10  # two formulations of one model, each by a solve
S = 2j * np.pi * np.geomspace(0.1, 100, 15)
#: [m] an arm whose square is a number that can be computed with, or none
LEVER = st.floats(-1, 1).map(lambda arm: arm if abs(arm) > 1e-30 else 0.0)


def quarter_car() -> hd.SecondOrderModel:
    """Body, wheel, strut with a half DOF, tyre on a road that stays free."""
    return hd.assemble(
        {
            "body": hd.point_mass(400),
            "wheel": hd.point_mass(40),
            "strut": hd.zener(k=2e4, k1=1e5, c1=1500),
            "tyre": hd.kelvin_voigt(k=2e5, c=50),
        },
        joints=[
            hd.Rigid("body_z", "strut_top"),
            hd.Rigid("wheel_z", "strut_bottom"),
            hd.Rigid("wheel_z", "tyre_top"),
        ],
    )


def test_quarter_car_is_the_one_written_by_hand() -> None:
    """DOFs keep the first names of ties; the road can be prescribed."""
    car = quarter_car()
    assert car.dofs == ("body_z", "wheel_z", "strut_1", "tyre_bottom")
    K = [[1.2e5, -2e4, -1e5, 0], [-2e4, 2.2e5, 0, -2e5], [-1e5, 0, 1e5, 0], [0, -2e5, 0, 2e5]]
    C = [[0, 0, 0, 0], [0, 1550, -1500, -50], [0, -1500, 1500, 0], [0, -50, 0, 50]]
    for found, desired in ((car.M, np.diag([400, 40, 0, 0])), (car.C, C), (car.K, K)):
        assert_allclose(found, desired, rtol=BY_HAND)
    driven = car.prescribe_motion("tyre_bottom")
    assert (driven.dofs, driven.inputs) == (("body_z", "wheel_z", "strut_1"), ("tyre_bottom",))


@given(
    places=st.lists(st.tuples(*[LEVER] * 3), min_size=1, max_size=4),
    k=st.tuples(*[st.floats(1e3, 1e5)] * 3),
)
def test_body_on_mounts_is_the_sum_over_lever_arms(places: list[tuple[float, ...]], k: tuple[float, ...]) -> None:
    """``K = sum of A^T diag(k) A`` with the (3, 6) lever arms A of the mounts."""
    names = [f"m{i}" for i in range(len(places))]
    engine = hd.rigid_body(200, [8, 12, 10], {f"p{i}": place for i, place in enumerate(places)})
    mounts = {name: hd.kelvin_voigt(dict(zip("xyz", k, strict=True)), 0.0, axes="xyz") for name in names}
    model = hd.assemble(
        {"engine": engine} | mounts,
        joints=[hd.Rigid(f"engine_p{i}", f"{name}_top") for i, name in enumerate(names)],
        ground=[f"{name}_bottom" for name in names],
    )
    K = np.zeros((6, 6))
    for x, y, z in places:
        A = np.hstack([np.eye(3), [[0, z, -y], [-z, 0, x], [y, -x, 0]]])
        K += A.T @ np.diag(k) @ A
    assert model.dofs == tuple(f"engine_{axis}" for axis in ("x", "y", "z", "rx", "ry", "rz"))
    assert_allclose(model.K, K, rtol=BY_HAND, atol=BY_HAND * np.abs(K).max())


def test_lever_arms_agree_with_constraints() -> None:
    """The same body with its points as DOFs of their own, held to it by multipliers (index 3)."""
    place = (0.3, -0.4, 0.2)
    mount = hd.zener(1e5, 5e4, 300, axes="xyz")
    engine = hd.rigid_body(50, [2, 3, 4], {"p": place, "q": (-0.5, 0.1, 0)})
    parts = {"engine": engine, "a": mount, "b": mount}
    joined = hd.assemble(
        parts, joints=[hd.Rigid("engine_p", "a_top"), hd.Rigid("engine_q", "b_top")], ground=["a_bottom", "b_bottom"]
    ).select("F_engine_z", "engine_ry")
    M, C, K = (np.zeros((6 + 12 + 6, 6 + 12 + 6)) for _ in range(3))
    M[:6, :6] = engine.M
    keep = [0, 1, 2, 6, 7, 8]
    G = np.zeros((6, 18))
    for i, at in enumerate((place, (-0.5, 0.1, 0.0))):
        span = slice(6 + 6 * i, 12 + 6 * i)
        C[span, span], K[span, span] = (X[np.ix_(keep, keep)] for X in (mount.C, mount.K))
        x, y, z = at
        G[3 * i : 3 * i + 3, :6] = np.hstack([np.eye(3), [[0, z, -y], [-z, 0, x], [y, -x, 0]]])
        G[3 * i : 3 * i + 3, 6 + 6 * i : 9 + 6 * i] = -np.eye(3)
    K[:18, 18:], K[18:, :18] = G.T, G
    by_hand = hd.mechss(M, C, K).select("F_q2", "q4")
    assert_allclose(joined(S), by_hand(S), rtol=SOLVED)
    assert hd.exact_reduction(by_hand).order == hd.exact_reduction(joined).order == 2 * 6 + 6


def test_two_bodies_at_a_hinge_have_the_force_as_a_dof() -> None:
    """The point of a moves along x as a_x does, which takes b's part by substitution; y and z take multipliers."""
    bars = {
        "a": hd.rigid_body(2, [1, 1, 1], {"end": (1, 0, 0)}),
        "b": hd.rigid_body(3, [1, 2, 2], {"end": (-1, 0.5, 0)}),
    }
    springs = [hd.Spring(f"{part}_{axis}", None, 100.0) for part in "ab" for axis in ("x", "y", "z", "rx", "ry", "rz")]
    model = cast("hd.SecondOrderModel", hd.assemble(bars, joints=[hd.Rigid("a_end", "b_end"), *springs]))
    assert [dof for dof in model.dofs if dof.startswith("tie_")] == ["tie_a_end_y", "tie_a_end_z"]
    gap = [model.outputs.index(name) for name in ("a_end_x", "b_end_x")]
    values = model.select("F_a_rx", [model.outputs[i] for i in gap])(S)
    assert_allclose(values[0], values[1], rtol=SOLVED)
    check = model.select("F_a_ry", ["b_x", "b_ry"])
    assert hd.mech2ss(check).nstates == 2 * 9
    assert hd.crosscheck(check, hd.mech2ss(check)).passed


def test_chain_of_parts_is_the_tridiagonal_one() -> None:
    """Twenty masses on springs from end to end."""
    n = 20
    parts = {f"m{i}": hd.point_mass(1.0 + i) for i in range(n)}
    joints = [hd.Spring(f"m{i}_z", f"m{i + 1}_z", 10.0 * (i + 1)) for i in range(n - 1)]
    model = cast("hd.SecondOrderModel", hd.assemble(parts, joints=[*joints, hd.Damper("m0_z", None, 3.0)]))
    k = 10.0 * np.arange(1, n)
    K = np.diag(np.r_[k, 0.0] + np.r_[0.0, k]) - np.diag(k, 1) - np.diag(k, -1)
    assert_allclose(model.K, K, rtol=BY_HAND)
    assert_array_equal(model.C, np.diag([3.0] + [0.0] * (n - 1)))


def test_joint_with_a_model_is_a_part_tied_at_both_ends() -> None:
    """A Maxwell branch as a joint against the zener strut."""
    parts = {"body": hd.point_mass(400), "wheel": hd.point_mass(40)}
    joints: list[AnyJoint] = [
        hd.Spring("body_z", "wheel_z", 2e4),
        hd.Joint("body_z", "wheel_z", hd.maxwell(1e5, 1500), name="damper"),
        hd.Joint("wheel_z", None, hd.kelvin_voigt(2e5, 50)),
    ]
    model = cast("hd.SecondOrderModel", hd.assemble(parts, joints=joints))
    assert model.dofs == ("body_z", "wheel_z", "damper_1")
    K = np.array([[1.2e5, -2e4, -1e5], [-2e4, 2.2e5, 0], [-1e5, 0, 1e5]])
    assert_allclose(model.K, K, rtol=BY_HAND)


def test_sparse_part_keeps_the_model_sparse() -> None:
    """A sparse grid on a mount, against the dense assembly."""
    n = 12
    K = sp.csc_array(sp.diags_array([[-1.0] * (n - 1), [2.0] * n, [-1.0] * (n - 1)], offsets=[-1, 0, 1]))
    beam = hd.mechss(sp.csc_array(sp.eye_array(n)), None, K)
    whole = hd.mechss(np.eye(n), None, K.toarray())
    joined = [
        hd.assemble({"beam": part, "mount": hd.zener(1, 2, 3)}, joints=[hd.Rigid("beam_q3", "mount_top")],
                    ground="mount_bottom").select("F_beam_q0", "beam_q11")
        for part in (beam, whole)
    ]  # fmt: skip
    assert joined[0].is_sparse
    assert not joined[1].is_sparse
    assert_allclose(joined[0](S), joined[1](S), rtol=SOLVED)


def test_truncated_substructures_join_at_their_interface() -> None:
    """Two truncated halves of a chain against the whole, as good as the truncations."""
    n = 40
    K = 2 * np.eye(n) - np.eye(n, k=1) - np.eye(n, k=-1)
    free = K.copy()
    free[-1, -1] = 1
    half = hd.mechss(np.eye(n), None, 1e4 * free).select([f"F_q{n - 1}", "F_q5"], [f"q{n - 1}", "q5"])
    small = hd.truncate_modes(half, n_modes=12)
    joined = hd.assemble({"left": small, "right": small}, joints=[hd.Rigid("left_q39", "right_q39")])
    whole_K = np.zeros((2 * n - 1, 2 * n - 1))
    whole_K[:n, :n] += 1e4 * free
    other = np.r_[n : 2 * n - 1, n - 1]
    whole_K[np.ix_(other, other)] += 1e4 * free
    M = np.eye(2 * n - 1)
    M[n - 1, n - 1] = 2.0
    whole = hd.mechss(M, None, whole_K).select("F_q5", f"q{n + 5}")
    s = 2j * np.pi * np.array([0.05, 0.13, 0.3])
    found = joined.select("F_left_q5", "right_q5")(s)
    assert_allclose(found, whole(s), rtol=10 * small.max_error + SOLVED)


def test_points_of_truncated_and_other_signals_are_kept() -> None:
    """An input that is no force on a DOF, and an output with a velocity, under composed names."""
    part = hd.mechss([[1]], None, [[4]], [[2.0]], None, [[3.0]], dofs="q", inputs="drive", outputs="speed")
    model = hd.assemble({"p": part, "s": hd.kelvin_voigt(1, 1)}, joints=[hd.Rigid("p_q", "s_top")], ground="s_bottom")
    assert (model.inputs, model.outputs) == (("F_p_q", "p_drive"), ("p_q", "p_speed"))
    s = 2.0j
    assert_allclose(model.select("p_drive", "p_speed")(s), 3.0 * s * 2.0 / (s**2 + s + 5.0), rtol=SOLVED)


@pytest.mark.parametrize(
    ("joints", "ground", "words"),
    [
        ([hd.Rigid("a_z", "s_top"), hd.Rigid("s_top", "a_z")], "s_bottom", r'Rigid\("s_top", "a_z"\) is redundant'),
        ([hd.Rigid("a_z", "s_top"), hd.Spring("a_z", "s_top", 3.0)], "s_bottom", "contradicts the rigid ties"),
        ([hd.Rigid("a_z", "s_top")], ["s_bottom", "s_bottom"], "ground of s_bottom is redundant"),
        ([], "s_bottom", "Nothing holds part a:"),
        ([], "a_z", "Nothing holds part s:"),
        ([hd.Rigid("a_z", "s_top")], ["s_bottom", "a_z"], "leave nothing to move"),
    ],
)
def test_contradictions_are_named(joints: list[hd.Rigid], ground: list[str], words: str) -> None:
    """Redundant, contradictory and missing joints."""
    with pytest.raises(AssemblyError, match=words):
        hd.assemble({"a": hd.point_mass(1), "s": hd.kelvin_voigt(2, 3)}, joints=joints, ground=ground)


def test_massless_parts_that_float_are_named() -> None:
    """Two springs in a row with both ends free."""
    parts = {"s": hd.kelvin_voigt(2, 3), "t": hd.maxwell(1, 1), "a": hd.point_mass(2), "u": hd.kelvin_voigt(1, 1)}
    joints = [hd.Rigid("s_bottom", "t_top"), hd.Rigid("a_z", "u_top")]
    with pytest.raises(AssemblyError, match="Nothing holds s_top, s_bottom, t_bottom, t_1") as refusal:
        hd.assemble(parts, joints=joints)
    assert refusal.value.names == ("s_top", "s_bottom", "t_bottom", "t_1")


def test_redundant_ties_between_bodies_are_named() -> None:
    """Seven ties of six DOFs: three points of two bodies tied in all axes."""
    points = {"p": (1, 0, 0), "q": (0, 1, 0), "r": (0, 0, 1)}
    bodies = {name: hd.rigid_body(1, [1, 1, 1], points) for name in "ab"}
    with pytest.raises(AssemblyError, match="redundant"):
        hd.assemble(bodies, joints=[hd.Rigid(f"a_{p}", f"b_{p}") for p in points])


def test_points_of_one_body_cannot_be_tied() -> None:
    """It would stop the body's rotation."""
    body = hd.rigid_body(1, [1, 1, 1], {"p": (1, 0, 0), "q": (0, 1, 0)})
    with pytest.raises(AssemblyError, match="contradicts part a: both are points of one rigid body"):
        hd.assemble({"a": body}, joints=[hd.Rigid("a_p", "a_q")])


def test_names_that_meet_or_are_unknown_are_refused() -> None:
    """part_dof is not unique for every choice of names; axes must match."""
    one = hd.mechss([[1]], None, [[1]], dofs="b_c")
    two = hd.mechss([[1]], None, [[1]], dofs="c")
    with pytest.raises(SignalNameError, match="a_b_c would name points of two parts, a and a_b"):
        hd.assemble({"a": one, "a_b": two})
    with pytest.raises(SignalNameError, match=r"No part has a point 's_to'\. .* part s has s_top, s_bottom"):
        hd.assemble({"a": hd.point_mass(1), "s": hd.kelvin_voigt(1, 1)}, joints=[hd.Rigid("a_z", "s_to")])
    with pytest.raises(SignalNameError, match="have not the same axes"):
        hd.assemble({"a": hd.point_mass(1, "xy"), "s": hd.kelvin_voigt(1, 1)}, joints=[hd.Rigid("a", "s_top")])
    with pytest.raises(SignalNameError, match="The joint a is called like a part"):
        hd.assemble({"a": hd.point_mass(1)}, joints=[hd.Joint("a_z", None, hd.kelvin_voigt(1, 1), name="a")])


def test_what_is_no_part_or_joint_is_refused() -> None:
    """By its kind."""
    with pytest.raises(ParameterError, match="parts must be a mapping"):
        hd.assemble({})
    with pytest.raises(ParameterError, match="Part 'a' is a float"):
        hd.assemble({"a": 1.0})  # type: ignore[dict-item]
    with pytest.raises(ParameterError, match="'a_z' is no joint: take Rigid, Spring, Damper or Joint"):
        hd.assemble({"a": hd.point_mass(1)}, joints=["a_z"])  # type: ignore[list-item]


def test_law_makes_the_model_nonlinear() -> None:
    """A spring with a law sits on the DOFs that ties leave; linear elements go into K."""
    parts = {"m": hd.point_mass(10), "s": hd.zener(1e4, 5e3, 100)}
    stop = hd.Spring("s_top", None, hd.laws.gap(1e5, 0.01))
    model = hd.assemble(parts, joints=[hd.Rigid("m_z", "s_top"), hd.Spring("m_z", None, 50.0), stop], ground="s_bottom")
    assert isinstance(model, NonlinearModel)
    assert [repr(element) for element in model.elements] == ['Spring("m_z", law=gap(1e5, 0.01))']
    assert_array_equal(model.linear.K, [[15050, -5000], [-5000, 5000]])


def test_law_at_a_point_that_is_no_dof_is_refused() -> None:
    """On a rigid body's lever arm, on several axes, or between points that move as one."""
    body = hd.rigid_body(5, [1, 1, 1], {"p": (1, 0, 0)})
    for end, words in (("e_p_z", "e_p_z is no DOF of its own"), ("e_p", "e_p is a point with several axes")):
        with pytest.raises(AssemblyError, match=words):
            hd.assemble({"e": body}, joints=[hd.Spring(end, None, hd.laws.gap(1e5, 0.01))])
    with pytest.raises(AssemblyError, match="its ends move as one"):
        hd.assemble(
            {"m": hd.point_mass(1), "s": hd.kelvin_voigt(1, 1)},
            joints=[hd.Rigid("m_z", "s_top"), hd.Spring("m_z", "s_top", hd.laws.gap(1e5, 0.01))],
            ground="s_bottom",
        )


def test_newcomers_model_needs_no_list_for_one_joint() -> None:
    """A single joint and a single ground."""
    parts = {"mass": hd.point_mass(2), "mount": hd.hydromount_part()}
    model = hd.assemble(parts, joints=hd.Rigid("mass_z", "mount_top"), ground="mount_bottom")
    paper = hd.hydromount(m=2)
    for found, desired in ((model.M, paper.M), (model.C, paper.C), (model.K, paper.K)):
        assert_array_equal(found, desired)


def test_large_sparse_part_is_joined_without_anything_dense() -> None:
    """A plate of 22 500 DOFs on two mounts: a dense matrix of its size would take 4 GB."""
    n = 150
    line = sp.diags_array([[-1.0] * (n - 1), [2.0] * n, [-1.0] * (n - 1)], offsets=[-1, 0, 1])
    K = sp.csc_array(sp.kron(line, sp.eye_array(n)) + sp.kron(sp.eye_array(n), line))
    plate = hd.mechss(sp.csc_array(sp.eye_array(n * n)), None, K).select("F_q7", "q7")
    model = hd.assemble(
        {"plate": plate, "a": hd.zener(1, 2, 3), "b": hd.zener(1, 2, 3)},
        joints=[hd.Rigid("plate_q100", "a_top"), hd.Rigid("plate_q9000", "b_top")],
        ground=["a_bottom", "b_bottom"],
    )
    assert model.is_sparse
    assert len(model.dofs) == n * n + 2
    assert as_sparse(model.K).nnz == K.nnz + 2 * 3  # each half DOF: its own entry and two that tie it
