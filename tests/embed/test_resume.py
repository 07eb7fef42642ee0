"""emcon_resume that is refused leaves the model as it was."""

from __future__ import annotations

import ctypes
import os
from pathlib import Path

import pytest
from embed_tools import ROOT, SANITIZED

DECK = str(ROOT/"input_decks"/"bouncing_bar.inp").encode()


@pytest.fixture(scope="module")
def library() -> ctypes.CDLL:
    if SANITIZED:
        pytest.skip("Python cannot load a library with the sanitizer in it")
    found = ctypes.CDLL(str(Path(os.environ.get("EMCON", ROOT/"build"/"release"/"emcon")).parent/"libemcon.so"))
    found.emcon_close.argtypes, found.emcon_close.restype = [ctypes.c_void_p], None
    found.emcon_message.argtypes, found.emcon_message.restype = [ctypes.c_void_p], ctypes.c_char_p
    return found


@pytest.fixture(scope="module")
def files(library: ctypes.CDLL, tmp_path_factory: pytest.TempPathFactory) -> dict[str, bytes]:
    """Paths: one that may be resumed, one that is cut off, none, one of text."""
    folder = tmp_path_factory.mktemp("resume")
    model = ctypes.c_void_p()
    assert library.emcon_open(DECK, None, 0, ctypes.byref(model)) == 0
    assert library.emcon_advance(model, None) == 0
    assert library.emcon_save(model, str(folder/"good.rst.h5").encode()) == 0
    library.emcon_close(model)
    data = (folder/"good.rst.h5").read_bytes()
    (folder/"cut.rst.h5").write_bytes(data[: len(data)//2])
    return {"good": str(folder/"good.rst.h5").encode(), "cut": str(folder/"cut.rst.h5").encode(),
            "none": b"/nonexistent.rst.h5", "text": DECK}


def time_of(library: ctypes.CDLL, model: ctypes.c_void_p) -> float:
    time = ctypes.c_double()
    assert library.emcon_get_time(model, ctypes.byref(time)) == 0
    return time.value


@pytest.mark.parametrize("name", ["good", "cut", "none", "text"])
def test_a_model_that_runs_goes_on(library: ctypes.CDLL, files: dict[str, bytes], name: str) -> None:
    model = ctypes.c_void_p()
    assert library.emcon_open(DECK, None, 0, ctypes.byref(model)) == 0
    assert library.emcon_advance(model, None) == 0
    time = time_of(library, model)
    assert library.emcon_resume(model, files[name]) in (2, 4)
    assert library.emcon_message(model)
    assert time_of(library, model) == time
    assert library.emcon_advance(model, None) == 0
    assert time_of(library, model) == 2*time
    library.emcon_close(model)


@pytest.mark.parametrize("name", ["cut", "none", "text"])
def test_a_model_that_was_read_can_be_built(library: ctypes.CDLL, files: dict[str, bytes], name: str) -> None:
    model = ctypes.c_void_p()
    assert library.emcon_read(DECK, None, 0, ctypes.byref(model)) == 0
    assert library.emcon_resume(model, files[name]) in (2, 4)
    assert library.emcon_build(model) == 0, library.emcon_message(model)
    assert library.emcon_advance(model, None) == 0
    library.emcon_close(model)


def test_one_that_is_resumed_goes_on_behind_another_that_was_refused(library: ctypes.CDLL, files: dict[str, bytes]) -> None:
    model = ctypes.c_void_p()
    assert library.emcon_read(DECK, None, 0, ctypes.byref(model)) == 0
    assert library.emcon_resume(model, files["cut"]) == 4
    assert library.emcon_resume(model, files["good"]) == 0, library.emcon_message(model)
    assert time_of(library, model) > 0
    library.emcon_close(model)
