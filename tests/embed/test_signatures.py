"""The compiled extension has what the headers declare, by the script that makes its signatures."""

from __future__ import annotations

import importlib.util
import re
import sys
from pathlib import Path
from types import ModuleType

import numpy as np
import pytest
from embed_tools import API, ROOT

sys.path.insert(0, str(ROOT/"pywrap"))
from emcon import _core  # noqa: E402



def script(path: Path) -> ModuleType:
    """A script as a module."""
    spec = importlib.util.spec_from_file_location(path.stem, path)
    assert spec and spec.loader
    module = importlib.util.module_from_spec(spec)
    sys.modules[path.stem] = module
    spec.loader.exec_module(module)
    return module


make_pyf = script(ROOT/"pywrap"/"make_pyf.py")
make_c = script(ROOT/"src_f90"/"make_c.py")
TEXT = (API/"emcon.h").read_text(encoding="utf-8")


def block(prototype: str) -> str:
    """The signature of a function, in a header with these types."""
    header = make_pyf.c_header.Header("typedef struct emcon_face emcon_face;\n" + prototype)
    (function,) = header.functions
    return str(make_pyf.Function(function, header).block())


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


SIZES = "typedef struct emcon_sizes { int n_node; } emcon_sizes;\n"


def made(prototype: str, procedure: str, folder: Path) -> str:
    """The C function of this prototype, made from a procedure of a Fortran source."""
    source = folder/"emcon_part.f90"
    source.write_text(procedure)
    header = make_c.Header("typedef struct emcon_model emcon_model;\n" + SIZES + prototype)
    return "\n".join(make_c.functions(header, make_c.procedures([source]))[1])


def subroutine(dummies: str, *declared: str) -> str:
    lines = ["type(stepper_t), intent(inout) :: self", *declared]
    return "\n".join([f"subroutine stepper_f(self, {dummies})", *lines, "end subroutine"])


def test_arguments_are_turned_by_what_both_sides_say(tmp_path: Path) -> None:
    text = made(
        "int emcon_f(emcon_model *model, int n_node, const double *u /* n_node x 2 */, "
        "const int *is_in /* n_node */, int load, int label, int *node);",
        subroutine("u, is_in, load, label, node", "real(wp), intent(in) :: u(:, :)",
                   "logical, intent(in) :: is_in(:)", "integer, intent(in) :: load, label",
                   "integer, intent(out) :: node"), tmp_path)
    assert 'check_count("n_node", n_node, sizes%n_node, u, error)' in text
    assert "c_f_pointer(u, c_u, [2, max(0, n_node)])" in text
    assert "source=c_is_in /= 0" in text
    assert "load=from_1(load), label=int(label)" in text
    assert "c_node = int(f_node - 1, c_int)" in text


@pytest.mark.parametrize(("prototype", "procedure", "told"), [
    ("int emcon_g(emcon_model *model);", "", "none of model_g, stepper_g"),
    ("int emcon_f(emcon_model *model, int n);", subroutine("h", "real(wp), intent(in) :: h"),
     "no argument h"),
    ("int emcon_f(emcon_model *model, int n);", subroutine("error",
                                                           "type(error_t), intent(out) :: error"),
     "no dummy for"),
    ("int emcon_f(emcon_model *model, int n_node, const double *u /* n_node x 2 */);",
     subroutine("u", "real(wp), intent(in) :: u(:)"), "u has 2 extents, but its dummy has 1"),
    ("int emcon_f(emcon_model *model, int n_node, double *u /* n_node */);",
     subroutine("u", "real(wp), intent(out) :: u(:)"), "u is an output that is not allocatable"),
    ("int emcon_f(emcon_model *model, int n, const double *u /* n */);",
     subroutine("u", "real(wp), intent(in), optional :: u(:)"), "left out in Fortran, but not NULL"),
    ("int emcon_f(emcon_model *model, int n);", subroutine("n", "real(wp), intent(in) :: n"),
     "n is int in C, but real in Fortran"),
    ("int emcon_f(emcon_model *model, int *n);", subroutine("n", "integer, intent(in) :: n"),
     r"n is intent\(out\) in C, not intent\(in\)"),
])
def test_a_function_that_fits_no_procedure_ends_the_script(
        prototype: str, procedure: str, told: str, tmp_path: Path) -> None:
    with pytest.raises(SystemExit, match=told):
        made(prototype, procedure, tmp_path)
