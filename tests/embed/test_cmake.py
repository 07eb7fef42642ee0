"""What is installed is found by CMake and pkg-config from any prefix, and taken away again."""

from __future__ import annotations

import ctypes
import os
import re
import shlex
import shutil
import subprocess
from pathlib import Path

import numpy as np
import pytest
from embed_tools import HERE, ROOT, SANITIZED, need, run
from landing_block import landing

from emcon import Stepper

RING = ROOT/"input_decks"/"ring.inp"
PROGRAM = ROOT/"build"/os.environ.get("MODE", "release")/"emcon"
#: A program that finds the library by itself.
PLAIN = {name: value for name, value in os.environ.items() if name != "LD_LIBRARY_PATH"}
pytestmark = pytest.mark.skipif(SANITIZED, reason="programs would have to have the sanitizer, too")


@pytest.fixture(scope="module")
def prefix(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """A prefix with blanks in its name."""
    folder = tmp_path_factory.mktemp("prefix")/"with blanks in it"
    run("make", "install", f"PREFIX={folder}", cwd=ROOT)
    return folder


def configure(prefix: Path, folder: Path, *more: str) -> subprocess.CompletedProcess[str]:
    need("cmake")
    return subprocess.run(["cmake", "-S", HERE/"cmake", "-B", folder, *more,
                           f"-DCMAKE_PREFIX_PATH={prefix}",
                           "-DCMAKE_CXX_FLAGS=-Wall -Wextra -pedantic -Werror"],
                          capture_output=True, text=True)


def test_the_border_of_cpp_by_cmake(prefix: Path, tmp_path: Path) -> None:
    """Shared, and with the library in it: the same digits, without a path to be set."""
    done = configure(prefix, tmp_path)
    assert done.returncode == 0, done.stderr
    run("cmake", "--build", tmp_path)
    shared, static = (run(tmp_path/name, RING, env=PLAIN) for name in ("border", "border_static"))
    assert shared == static and len(shared.split()) == 2
    assert "libemcon" not in run("ldd", tmp_path/"border_static")


@pytest.fixture(scope="module")
def blocks(prefix: Path, tmp_path_factory: pytest.TempPathFactory) -> Path:
    folder = tmp_path_factory.mktemp("blocks")
    done = configure(prefix, folder, "-DCMAKE_BUILD_TYPE=Release")
    assert done.returncode == 0, done.stderr
    run("cmake", "--build", folder, "--target", "blocks")
    return folder/"blocks"


@pytest.mark.parametrize("friction", [0.0, 0.3, 0.8])
@pytest.mark.parametrize(("name", "kind"), [("nodes", "NODE TO SURFACE"), ("mortar", "MORTAR")])
def test_a_solid_in_cpp_does_what_the_program_does(blocks: Path, name: str, kind: str, friction: float) -> None:
    """Impact, sliding, sticking and parting, by candidates and a map, to round-off."""
    first, *numbers = run(blocks, name, friction, 12, env=PLAIN).splitlines()
    words = first.split()
    drift, lost, n_stuck, n_slid = (float(word) for word in words[1::2])
    with Stepper(landing(kind, friction)) as program:
        for _ in range(12):
            program.step(0.02)
        np.testing.assert_allclose(np.array(numbers, float).reshape(-1, 3), program.u[8:], rtol=0, atol=1e-13)
        assert lost == pytest.approx(program.ledger["friction_loss"], abs=1e-13)
    assert drift < 1e-13 and (n_slid > 0) == (friction > 0) and n_stuck + n_slid > 40
    assert (n_stuck > 20) == (friction != 0.3)


def block_of(language: str) -> str:
    """The only block of docs/embedding.md in a language."""
    text = (ROOT/"docs"/"embedding.md").read_text(encoding="utf-8")
    (block,) = re.findall(rf"^```{language}\n(.*?)^```", text, re.MULTILINE | re.DOTALL)
    return block


def test_the_blocks_of_the_docs(prefix: Path, tmp_path: Path) -> None:
    """Those for CMake, C++ and a shell, as they stand there, about the deck beside them."""
    need("cmake")
    find, link = block_of("cmake").splitlines()
    (tmp_path/"CMakeLists.txt").write_text(
        "cmake_minimum_required(VERSION 3.16)\nproject(page LANGUAGES CXX)\n"
        f"set(CMAKE_CXX_STANDARD 11)\n{find}\nadd_executable(host host.cpp)\n{link}\n")
    (tmp_path/"host.cpp").write_text("#include <emcon.hpp>\nint main()\n{\n" + block_of("cpp")
                                     + "return u.size() > 100 ? 0 : 1;\n}\n")
    shutil.copy(RING, tmp_path)
    run("cmake", "-S", tmp_path, "-B", tmp_path/"made", f"-DCMAKE_PREFIX_PATH={prefix}")
    run("cmake", "--build", tmp_path/"made")
    run(tmp_path/"made"/"host", cwd=tmp_path, env=PLAIN)
    (line,) = re.findall(r"^cc host\.c .*", (ROOT/"docs"/"embedding.md").read_text(), re.MULTILINE)
    shutil.copy(HERE/"impact.c", tmp_path/"host.c")
    (tmp_path/"prefix").symlink_to(prefix)         # a shell takes words apart at blanks
    run("sh", "-c", line, cwd=tmp_path,
        env=PLAIN | {"PKG_CONFIG_PATH": str(tmp_path/"prefix"/"lib"/"pkgconfig")})
    found = run(tmp_path/"a.out", RING, "h=0.05\nt_end=0.1",
                env=PLAIN | {"LD_LIBRARY_PATH": str(prefix/"lib")})
    assert found.startswith("1 ")


@pytest.mark.parametrize(("asked", "fits"), [("0.5", True), ("0.5.0", True), ("0.5.99", False),
                                             ("0.4", False), ("1.0", False)])
def test_versions_that_serve(prefix: Path, tmp_path: Path, asked: str, fits: bool) -> None:
    need("cmake")
    (tmp_path/"CMakeLists.txt").write_text(
        "cmake_minimum_required(VERSION 3.16)\nproject(asks LANGUAGES C)\n"
        f"find_package(emcon {asked} REQUIRED)\n")
    done = subprocess.run(["cmake", "-S", tmp_path, "-B", tmp_path/"build",
                           f"-DCMAKE_PREFIX_PATH={prefix}"], capture_output=True, text=True)
    assert (done.returncode == 0) == fits, done.stderr


@pytest.mark.parametrize("package", ["emcon", "emcon-static"])
def test_a_host_in_c_by_pkg_config(prefix: Path, tmp_path: Path, package: str) -> None:
    """Flags as a shell reads them; `libdir` tells the place for -rpath."""
    env = PLAIN | {"PKG_CONFIG_PATH": str(prefix/"lib"/"pkgconfig")}
    flags = shlex.split(run("pkg-config", "--cflags", "--libs", package, env=env))
    (libdir,) = shlex.split(run("pkg-config", "--variable=libdir", package, env=env))
    rpath = [f"-Wl,-rpath,{libdir}"] if package == "emcon" else []
    run("cc", HERE/"impact.c", "-o", tmp_path/"impact", *flags, *rpath)
    verdict, _ = run(tmp_path/"impact", RING, "h=0.05\nt_end=0.1", env=PLAIN).splitlines()
    assert verdict.startswith("1 ")


def test_what_is_installed_is_taken_away(tmp_path: Path) -> None:
    """And nothing else."""
    prefix = tmp_path/"some prefix"
    (prefix/"include"/"emcon").mkdir(parents=True)
    theirs = prefix/"include"/"emcon"/"theirs.h"
    theirs.write_text("")
    run("make", "install", f"PREFIX={prefix}", cwd=ROOT)
    assert {"emcon.h", "emcon.hpp", "emcon_api.mod"} <= {
        path.name for path in theirs.parent.iterdir()}
    run("make", "uninstall", f"PREFIX={prefix}", cwd=ROOT)
    assert [path for path in prefix.rglob("*") if path.is_file()] == [theirs]


def test_symbols_are_those_of_headers_and_modules(prefix: Path) -> None:
    shown = run("nm", "-D", "--defined-only", prefix/"lib"/"libemcon.so").splitlines()
    names = {line.split()[-1] for line in shown}
    header = (prefix/"include"/"emcon"/"emcon.h").read_text()
    declared = set(re.findall(r"^[a-z][\w *]*?(emcon_\w+)\(", header, re.MULTILINE))
    modules = {path.stem for path in (prefix/"include"/"emcon").glob("*.mod")}
    others = names - declared
    assert names >= declared
    assert {re.match(r"__(emcon_\w+?)(?:\.\w+)?_MOD_", name)[1] for name in others} <= modules


def test_each_code_has_a_text(prefix: Path) -> None:
    library = ctypes.CDLL(str(prefix/"lib"/"libemcon.so"))
    library.emcon_status_text.restype = ctypes.c_char_p
    header = (prefix/"include"/"emcon"/"emcon.h").read_text()
    codes = [0, *(int(code) for code in re.findall(r"EMCON_ERROR_\w+ = (\d+)", header))]
    texts = [library.emcon_status_text(code) for code in codes]
    assert len(codes) == 6 and len(set(texts)) == 6 and all(texts)
    assert library.emcon_status_text(77) == library.emcon_status_text(-1) not in texts


def test_the_man_page_has_what_the_help_has(prefix: Path) -> None:
    page = (prefix/"share"/"man"/"man1"/"emcon.1").read_text().replace(r"\-", "-")
    usage = run(PROGRAM, "--help")
    options = set(re.findall(r"--[a-z]+", usage))
    assert options == set(re.findall(r"--[a-z]+", page)) and len(options) > 8
    codes = set(re.findall(r"(?:exit:|^) +(\d+) ", usage, re.M)) | {"2", "130"}
    assert codes == set(re.findall(r"^\.B (\d+)$", page, re.M))
