"""The compiled extension has what the headers declare, by the script that makes its signatures."""

from __future__ import annotations

import importlib.util
import re
import sys

import numpy as np
import pytest
from embed_tools import API, ROOT

sys.path.insert(0, str(ROOT/"pywrap"))
from emcon import _core  # noqa: E402

_spec = importlib.util.spec_from_file_location("make_pyf", ROOT/"pywrap"/"make_pyf.py")
assert _spec and _spec.loader
make_pyf = importlib.util.module_from_spec(_spec)
sys.modules["make_pyf"] = make_pyf
_spec.loader.exec_module(make_pyf)
TEXT = (API/"emcon.h").read_text(encoding="utf-8")


def block(prototype: str) -> str:
    """The signature of a function, in a header with these types."""
    headers = make_pyf.Headers()
    headers.read("typedef struct emcon_face emcon_face;\n"
                 + prototype)
    (function,) = headers.functions
    return str(make_pyf.Function(headers, *function).block())


def test_extension_has_each_function_of_the_headers_and_no_other() -> None:
    declared = set(re.findall(r"^[a-z][\w *]*?(emcon_\w+)\(", TEXT, re.MULTILINE))
    assert len(declared) > 70
    assert declared == {name for name in vars(_core) if name.startswith("emcon_")}


def test_constants_are_those_of_the_headers() -> None:
    declared = {name: int(value) for name, value in re.findall(r"\b(EMCON_\w+) = (\d+)", TEXT)}
    assert len(declared) > 20
    assert declared == {name: value for name, value in vars(_core).items()
                        if name.startswith("EMCON_")}


def test_arrays_of_other_sizes_are_refused() -> None:
    status, model = _core.emcon_open(str(ROOT/"input_decks"/"ring.inp").encode(), b"", 0)
    assert status == 0
    status, sizes = _core.emcon_get_sizes(model)
    assert status == 0
    n = int(sizes.view(np.int32)[0])
    u = np.zeros((n, 2))
    assert _core.emcon_constraints(model, u, u, 0)[0] == 0
    for u0, u1 in ((u, u[1:]), (u[1:], u), (u, u[:0]), (u[:, :1], u)):
        with pytest.raises(Exception, match="n_node|array size"):
            _core.emcon_constraints(model, u0, u1, 0)
    assert _core.emcon_constraints(model, u[1:], u[1:], 0)[0] == 2        # by the library
    nothing = np.empty(0)
    with pytest.raises(Exception, match="len_v"):
        _core.emcon_set_state(model, n, u, u[1:], 0, nothing, np.empty(0, np.int32), nothing)
    status, x = _core.emcon_get_positions(model, n)
    assert status == 0 and x.shape == (n, 2) and x.flags.c_contiguous
    status, u, v = _core.emcon_get_state(model, n, no_v=1)
    assert status == 0 and u.shape == (n, 2) and v.size == 0
    _core.emcon_close(model)


def test_sizes_stand_behind_arrays() -> None:
    text = block("int emcon_f(emcon_face *face, int n, const double *x /* n x 2 */, int *at);")
    assert "subroutine emcon_f(status, face, n, x, at, len_x)" in text
    assert "double precision dimension(len_x,2),intent(in,c) :: x" in text
    assert "integer intent(hide),depend(x) :: n = shape(x,0)" in text
    assert "emcon_f((emcon_face *)(npy_intp)face, n, x, &at)" in text
    assert "threadsafe" in text and "threadsafe" not in block("int emcon_get_n(int *n);")


def test_what_is_not_understood_ends_the_script() -> None:
    with pytest.raises(SystemExit, match="what is emcon_stranger"):
        block("int emcon_f(const emcon_stranger *x);")
    with pytest.raises(SystemExit, match="emcon_f is not told n_node"):
        block("int emcon_f(emcon_face *face, const double *x /* n_node x 2 */);")
    with pytest.raises(SystemExit, match="not understood"):
        block("int emcon_f(int (*callback)(int, int));")
