"""Matrices of structures from files, as they are written by NumPy, SciPy and MATLAB."""

from __future__ import annotations

import numpy as np
import pytest
import scipy.io
import scipy.sparse as sp

import saltus as sl
from saltus.errors import ParameterError

M, K = np.diag([1.0, 2.0, 3.0]), 2 * np.eye(3) - np.eye(3, k=1) - np.eye(3, k=-1)
C = 0.1 * K
NAMES = ["u_1", "w_1", "w_2"]


def npz(path):
    np.savez(path / "all.npz", M=M, K=K, C=C, names=NAMES)
    return (path / "all.npz",)


def words(path):
    np.savez(path / "words.npz", mass=M, stiffness=K, damping=C, names=np.array(NAMES))
    return (str(path / "words.npz"),)


def matlab(path):
    names = np.array(NAMES, dtype=object)  # a cell array
    scipy.io.savemat(path / "all.mat", {"M": sp.csc_array(M), "K": K, "C": C, "names": names})
    return (path / "all.mat",)


def market(path):
    for name, matrix in (("M", M), ("K", K), ("C", C)):
        scipy.io.mmwrite(path / f"{name}.mtx", sp.coo_array(matrix), symmetry="symmetric")
    return tuple(path / f"{name}.mtx" for name in "MKC")


def one_by_one(path):
    sp.save_npz(path / "M.npz", sp.csr_array(M))
    np.save(path / "K.npy", K)
    return path / "M.npz", path / "K.npy", C


@pytest.mark.parametrize("written", [npz, words, matlab, market, one_by_one])
def test_a_structure_from_files(written, tmp_path):
    names = None if written in (npz, words, matlab) else NAMES
    stop = sl.Contact("w_2", 5.0, 0.1)
    made = sl.structure(*written(tmp_path), contacts=[stop], names=names)
    truth = sl.structure(M, K, C, contacts=[stop], names=NAMES)
    assert made.fingerprint() == truth.fingerprint()
    given = written(tmp_path)[:2]
    assert sl.structure_modes(*given).frequency.values.tolist() == (
        sl.structure_modes(M, K).frequency.values.tolist()
    )


def test_names_of_the_user_come_first(tmp_path):
    assert sl.structure(*npz(tmp_path), names="a b c").states[0] == "a"


def a_file(path, name="bad.npz", **held):
    np.savez(path / name, **held)
    return path / name


@pytest.mark.parametrize(
    ("make", "message"),
    [
        (lambda path: "plate", "is no matrix, and no file of matrices"),
        (lambda path: path / "gone.npz", "can't be read: No such file"),
        (lambda path: path, "no file of matrices"),
        (lambda path: a_file(path, A=M, B=K), "'A', 'B', and no mass and no stiffness matrix"),
        (lambda path: a_file(path, M=M, B=K), "no stiffness matrix, called K"),
        (lambda path: a_file(path, M=M, mass=M, K=K), "two mass matrices, M and mass"),
        (lambda path: a_file(path, M=np.array([{}], dtype=object), K=K), "allow_pickle"),
        (lambda path: a_file(path, M=M, K=K[:2, :2]), "2 x 2, but mass is 3 x 3"),
        (lambda path: a_file(path, M=M, K=K, names=["a"]), "3 degrees of freedom"),
    ],
)
def test_what_is_no_file_of_matrices(make, message, tmp_path):
    with pytest.raises(ParameterError, match=message):
        sl.structure(make(tmp_path))


@pytest.mark.parametrize("ending", ["npz", "npy", "mat", "mtx"])
@pytest.mark.parametrize("held", [b"", b"rubbish", b"PK\x03\x04 and more of it", b"\x00" * 4000])
def test_rubbish_is_refused_in_words(ending, held, tmp_path):
    path = tmp_path / f"rubbish.{ending}"
    path.write_bytes(held)
    with pytest.raises(ParameterError, match="rubbish"):
        sl.structure(path)
    with pytest.raises(ParameterError):
        sl.structure(M, path)


def test_a_file_cut_short(tmp_path):
    (path,) = npz(tmp_path)
    whole = path.read_bytes()
    for length in range(0, len(whole), 97):
        path.write_bytes(whole[:length])
        with pytest.raises(ParameterError, match="can't be read"):
            sl.structure(path)


def test_a_mass_alone_asks_for_more(tmp_path):
    with pytest.raises(ParameterError, match="a mass and a stiffness matrix"):
        sl.structure(M)
    np.save(tmp_path / "M.npy", M)
    with pytest.raises(ParameterError, match=r"holds one matrix.*stands for this one"):
        sl.structure(tmp_path / "M.npy")
    with pytest.raises(ParameterError, match="a damping matrix, and damping= is another"):
        sl.structure(*npz(tmp_path), damping=C)
    with pytest.raises(ParameterError, match="or that of a file, or damping_ratio"):
        sl.structure(*npz(tmp_path), damping_ratio=0.1)


@pytest.mark.parametrize("kind", ["coordinate", "array"])
def test_more_degrees_of_freedom_than_fit(kind, tmp_path):
    """Refused by their number: no memory is taken for them, in which 8 GB would be zeros."""
    size = "2000000000 2000000000 1\n1 1" if kind == "coordinate" else "200000 200000\n"
    (tmp_path / "M.mtx").write_text(f"%%MatrixMarket matrix {kind} real symmetric\n{size} 1.0\n")
    with pytest.raises(ParameterError, match="at most"):
        sl.structure(tmp_path / "M.mtx", K)


def test_a_long_file_of_matrix_market(tmp_path):
    """SciPy's reader of open files ended the process from some lines on."""
    size = 400
    chain = sp.diags_array([-np.ones(size - 1), 2e3 * np.ones(size), -np.ones(size - 1)],
        offsets=[-1, 0, 1])  # fmt: skip
    scipy.io.mmwrite(tmp_path / "K.mtx", chain)
    scipy.io.mmwrite(tmp_path / "M.mtx", sp.eye_array(size))
    made = sl.structure(tmp_path / "M.mtx", tmp_path / "K.mtx", modes=2)
    assert made.fingerprint() == sl.structure(sp.eye_array(size), chain, modes=2).fingerprint()
