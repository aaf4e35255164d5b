"""Products and inverses that no library of the processor's has a part in."""

import ast
import re
from pathlib import Path

import numpy as np

import fogsim
from fogsim.core.linear_algebra import (
    cholesky_factor,
    convolution,
    inverse_of,
    matrix_product,
    solved_lower,
    solved_upper,
    straight_line,
    times,
)

RNG = np.random.default_rng(3)


def test_a_product_is_that_of_matrices() -> None:
    empty = ((0,), (0, 3)), ((0, 3), (3, 3))
    for left, right in [((4,), (4,)), ((3, 4), (4,)), ((4,), (4, 2)), ((5, 4), (4, 3)), ((2, 5, 3), (3, 3)), *empty]:
        a, b = RNG.normal(size=left), RNG.normal(size=right)
        np.testing.assert_allclose(matrix_product(a, b), a @ b, rtol=1e-13, atol=1e-15)
        assert matrix_product(a.astype(np.float32), b.astype(np.float32)).dtype == np.float32


def test_products_for_kernels_are_the_same() -> None:
    a, b, c = RNG.normal(size=(5, 4)), RNG.normal(size=(4, 7)), RNG.normal(size=4)
    np.testing.assert_allclose(times(a, c), a @ c, rtol=1e-13, atol=1e-15)
    for one, other in ((b[0], c), (c, b[0]), (RNG.normal(size=9), c[:2]), (c[:1], c)):
        np.testing.assert_allclose(convolution(one, other), np.convolve(one, other), rtol=1e-13, atol=1e-15)


def test_an_inverse_undoes_normal_equations_of_any_units() -> None:
    for size in [1, 2, 3, 5, 9]:
        jacobian = RNG.normal(size=(40, size)) * 10.0 ** RNG.uniform(-5, 5, size)
        normal = matrix_product(jacobian.T, jacobian)
        units = np.sqrt(np.multiply.outer(np.diag(normal), np.diag(normal)))
        np.testing.assert_allclose((inverse_of(normal) * units) @ (normal / units), np.eye(size), atol=1e-12)


def test_what_nothing_is_known_of_has_zeros() -> None:
    normal = np.array([[2.0, 0.0, 1.0], [0.0, 0.0, 0.0], [1.0, 0.0, 2.0]])
    np.testing.assert_allclose(inverse_of(normal), np.linalg.pinv(normal), atol=1e-15)
    assert not inverse_of(np.zeros((3, 3))).any()


def test_where_two_say_the_same_one_is_left_out() -> None:
    jacobian = RNG.normal(size=(20, 3))
    jacobian[:, 2] = 2.0 * jacobian[:, 0]
    normal = matrix_product(jacobian.T, jacobian)
    inverse = inverse_of(normal)
    np.testing.assert_allclose(normal @ inverse @ normal, normal, rtol=1e-12)
    assert sorted(inverse.any(axis=0).tolist()) == [False, True, True]


def test_a_factor_and_what_it_solves() -> None:
    root, right = RNG.normal(size=(7, 9)), RNG.normal(size=(7, 3))
    matrix = root @ root.T
    factor = cholesky_factor(matrix)
    np.testing.assert_allclose(factor, np.linalg.cholesky(matrix), rtol=1e-9)
    solution = solved_upper(factor, solved_lower(factor, right))
    np.testing.assert_allclose(solution, np.linalg.solve(matrix, right), rtol=1e-7)


def test_a_straight_line_has_the_least_squares() -> None:
    x, y = RNG.normal(size=30), RNG.normal(size=30)
    np.testing.assert_allclose(straight_line(x, y), np.polyfit(x, y, 1), rtol=1e-12)


FOREIGN = {"dot", "vdot", "inner", "matmul", "tensordot", "convolve", "correlate", "polyfit", "roots", "cov"}
FOREIGN |= {"corrcoef"}


def _through_blas(source: str) -> list[int]:
    """Lines of a source that call BLAS or LAPACK through numpy."""
    if not re.search(rf" @=? |np\.(linalg|{'|'.join(FOREIGN)})\b", source):
        return []
    lines = []
    for node in ast.walk(ast.parse(source)):
        if isinstance(node, ast.BinOp | ast.AugAssign) and isinstance(node.op, ast.MatMult):
            lines.append(node.lineno)
        if isinstance(node, ast.Attribute) and ast.unparse(node.value) == "np" and node.attr in FOREIGN:
            lines.append(node.lineno)
        if isinstance(node, ast.Call) and ast.unparse(node.func).startswith("np.linalg."):
            # Along an axis, a norm is a sum of squares; of a whole array, it is BLAS's.
            along = any(word.arg == "axis" for word in node.keywords)
            if not (ast.unparse(node.func) == "np.linalg.norm" and along):
                lines.append(node.lineno)
    return lines


def test_nothing_goes_through_blas() -> None:
    package = Path(fogsim.__file__).parent
    found = {
        f"{path.relative_to(package)}:{line}"
        for path in package.rglob("*.py")
        for line in _through_blas(path.read_text(encoding="utf-8"))
    }
    assert not found


def test_what_goes_through_blas_is_found() -> None:
    for source in ["a @ b", "a @= b", "np.dot(a, b)", "np.linalg.norm(a)", "np.linalg.solve(a, b)"]:
        assert _through_blas(source) == [1]
        assert not _through_blas("np.linalg.norm(a, axis=1)")
