"""Claims about names of DOFs: one name a label, and names that models take."""

from hypothesis import given
from hypothesis import strategies as st

from halfdof_ctrl.base.names import checked_dofs
from halfdof_ctrl.files.formats.labels import ansys_name, dof_names, translations

LABELS = st.sets(st.tuples(st.integers(-9, 2**31 - 1), st.integers(0, 20)), min_size=1, max_size=40)


@given(labels=LABELS)
def test_different_labels_get_different_names_that_a_model_takes(labels: set[tuple[int, int]]) -> None:
    """Nodes, scalar points and internal nodes never share a name with another or with a derivative."""
    names = dof_names(*zip(*sorted(labels), strict=True))
    assert checked_dofs(names, len(labels)) == names
    assert len(set(names)) == len(labels)


def test_components_one_to_six_are_displacements_and_rotations() -> None:
    """As the table in the module says."""
    names = dof_names([7] * 6, range(1, 7))
    assert names == ("n7_u1", "n7_u2", "n7_u3", "n7_r1", "n7_r2", "n7_r3")
    assert tuple(ansys_name(7, label) for label in ("UX", "uy", "UZ", "ROTX", "ROTY", "rotz")) == names


def test_other_labels_keep_their_word() -> None:
    """Temperature, pressure, scalar points, internal nodes."""
    assert dof_names([7, 7, 12, -3], [8, 11, 0, 2]) == ("n7_d8", "n7_d11", "n12", "internal3_2")
    assert ansys_name(7, "TEMP") == "n7_temp"


def test_only_translations_of_nodes_have_a_direction() -> None:
    """The mass per direction sums over these."""
    names = ("n1_u1", "n1_u3", "n1_r1", "n1", "internal1_1", "u1", "q_u1")
    found = {direction: which.tolist() for direction, which in translations(names).items()}
    assert found == {"u1": [1.0, *[0.0] * 6], "u2": [0.0] * 7, "u3": [0.0, 1.0, *[0.0] * 5]}
