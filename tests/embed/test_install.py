"""`pip install ./pywrap`: a wheel is complete, made for one interpreter, and runs on its own."""

from __future__ import annotations

import json
import os
import shutil
import subprocess
import sys
import sysconfig
import tomllib
import zipfile
from pathlib import Path

import pytest

ROOT = Path(__file__).parents[2]
PACKAGE = ROOT/"pywrap"
sys.path.insert(0, str(PACKAGE))

from emcon.stepper import Stepper  # noqa: E402

RING = ROOT/"input_decks"/"ring.inp"
PROJECT = tomllib.loads((PACKAGE/"pyproject.toml").read_text(encoding="utf-8"))["project"]
VERSION = PROJECT["version"]
BESIDE = {"emcon/py.typed", "emcon/_core.pyi"}
LIBRARY = f"libemcon.so.{'.'.join(VERSION.split('.')[:2 if VERSION.startswith('0.') else 1])}"
COMPILED = {f"emcon/_core{sysconfig.get_config_var('EXT_SUFFIX')}", f"emcon/{LIBRARY}"}
NO_PATH = {name: value for name, value in os.environ.items() if name != "PYTHONPATH"}
ONE_INCREMENT = """
import importlib.metadata, json, sys
sys.path.insert(0, sys.argv[1])
import emcon
from emcon import _core
from emcon.stepper import Stepper
with Stepper(sys.argv[2], h=0.05) as ring:
    ring.step()
    energies = ring.energies()
with open("/proc/self/maps") as maps:
    (library,) = {line.split()[-1] for line in maps if "libemcon" in line}
print(json.dumps({"energies": energies, "files": [emcon.__file__, _core.__file__, library],
                  "versions": [emcon.__version__, importlib.metadata.version("emcon")]}))
"""
#: Stands for the Makefile where a test is about what is done with its products.
MAKEFILE = """.PHONY: pywrap
pywrap:
	test -z "$(PY_READY)$(THEIRS)"
	$(PY) -c 'import numpy'
	echo made > $(PACKAGE)/_core$(EXT_SUFFIX)
	echo made > $(PACKAGE)/LIBRARY
""".replace("LIBRARY", LIBRARY)


def pip_wheel(package: Path, into: Path, **env: str) -> subprocess.CompletedProcess[str]:
    """A wheel with what .venv has: no network, no environment of its own."""
    return subprocess.run([sys.executable, "-m", "pip", "wheel", "--no-build-isolation",
                           "--no-deps", "--no-index", "--wheel-dir", into, package],
                          env=os.environ | env, capture_output=True, text=True)


def setup(package: Path, command: str, **env: str) -> subprocess.CompletedProcess[str]:
    return subprocess.run([sys.executable, "setup.py", command], cwd=package, env=os.environ | env,
                          capture_output=True, text=True)


def files(folder: Path, pattern: str = "*") -> set[str]:
    return {str(path.relative_to(folder)) for path in folder.rglob(pattern) if path.is_file()}


def python_files(package: Path) -> set[str]:
    return {name for name in files(package, "*.py") if name.startswith("emcon/")}


@pytest.fixture(scope="module")
def wheel(tmp_path_factory: pytest.TempPathFactory) -> Path:
    folder = tmp_path_factory.mktemp("wheel")
    done = pip_wheel(PACKAGE, folder)
    assert done.returncode == 0, done.stdout + done.stderr
    (file,) = folder.iterdir()
    return file


@pytest.fixture
def tree(tmp_path: Path) -> Path:
    """A source tree with products of another interpreter in it, and a Makefile that is quick."""
    shutil.copytree(PACKAGE, tmp_path/"tree"/"pywrap",
                    ignore=shutil.ignore_patterns("_core*.so", "libemcon*", "__pycache__", "build",
                                                  "dist", "*.egg-info"))
    package = tmp_path/"tree"/"pywrap"
    (tmp_path/"tree"/"src_f90").mkdir()
    (tmp_path/"tree"/"Makefile").write_text(MAKEFILE)
    (package/"emcon.egg-info").mkdir()
    listed = ["pyproject.toml", "setup.py", *python_files(package)]
    stale = ["emcon/_core.cpython-36m-x86_64-linux-gnu.so", "emcon/libemcon.so.0", *COMPILED]
    for name in {*stale, "build/lib/emcon/gone.py", "emcon/_core.so"}:
        (package/name).parent.mkdir(parents=True, exist_ok=True)
        (package/name).write_text("stale\n")
    (package/"emcon.egg-info"/"SOURCES.txt").write_text("\n".join([*listed, *stale]))
    return tmp_path/"tree"


def test_wheel_is_complete_and_for_this_interpreter(wheel: Path) -> None:
    names = set(zipfile.ZipFile(wheel).namelist())
    within = {name for name in names if name.startswith("emcon/")}
    assert within == python_files(PACKAGE) | COMPILED | BESIDE
    assert {name.split("/")[0] for name in names} == {"emcon", f"emcon-{VERSION}.dist-info"}
    tag = f"cp{sys.version_info.major}{sys.version_info.minor}"
    platform = sysconfig.get_platform().replace("-", "_")
    assert wheel.name == f"emcon-{VERSION}-{tag}-{tag}{sys.abiflags}-{platform}.whl"


def test_unpacked_wheel_gives_the_bits_of_the_tree(wheel: Path, tmp_path: Path) -> None:
    with zipfile.ZipFile(wheel) as archive:
        archive.extractall(tmp_path/"unpacked")
    done = subprocess.run([sys.executable, "-c", ONE_INCREMENT, tmp_path/"unpacked", RING],
                          cwd=tmp_path, env=NO_PATH, capture_output=True, text=True)
    assert done.returncode == 0, done.stderr
    found = json.loads(done.stdout)
    assert all(Path(file).is_relative_to(tmp_path/"unpacked") for file in found["files"])
    assert found["versions"] == [VERSION, VERSION]
    with Stepper(RING, h=0.05) as ring:
        ring.step()
        assert found["energies"] == ring.energies()


def test_nothing_slips_in_or_is_left(tree: Path, tmp_path: Path) -> None:
    before = files(tree)
    done = pip_wheel(tree/"pywrap", tmp_path, MAKEFLAGS="n -- THEIRS=theirs")
    assert done.returncode == 0, done.stdout + done.stderr
    (file,) = tmp_path.glob("*.whl")
    with zipfile.ZipFile(file) as archive:
        within = {name for name in archive.namelist() if name.startswith("emcon/")}
        assert within == python_files(PACKAGE) | COMPILED | BESIDE
        assert all(archive.read(name) == b"made\n" for name in COMPILED)
    assert files(tree) == before | {"build/.lock"}


def test_reason_of_a_failed_build_is_the_last_that_pip_shows(tree: Path, tmp_path: Path) -> None:
    (tree/"Makefile").write_text("$(error EMCON needs the packages gfortran)\npywrap:\n")
    done = pip_wheel(tree/"pywrap", tmp_path)
    text = done.stdout + done.stderr
    assert done.returncode != 0 and "Traceback" not in text
    assert text.index("EMCON needs the packages gfortran") < text.index(
        "error: EMCON could not be compiled; the reason stands above")
    assert not list(tmp_path.glob("*.whl")) and not list((tree/"build").glob("pip-*"))


def test_wheel_without_an_extension_is_refused(tree: Path) -> None:
    (tree/"Makefile").write_text(".PHONY: pywrap\n")
    done = setup(tree/"pywrap", "bdist_wheel")
    assert done.returncode != 0 and "error: EMCON could not be compiled" in done.stderr
    assert not list(tree.rglob("*.whl"))


def test_old_numpy_is_refused(tree: Path, tmp_path: Path) -> None:
    (tmp_path/"numpy-1.26.4.dist-info").mkdir()
    (tmp_path/"numpy-1.26.4.dist-info"/"METADATA").write_text("Name: numpy\nVersion: 1.26.4\n")
    done = setup(tree/"pywrap", "bdist_wheel", PYTHONPATH=str(tmp_path))
    assert done.returncode != 0 and "Traceback" not in done.stderr
    assert f"{sys.executable} has 1.26.4: pip install 'numpy >=2.0, <3'" in done.stderr


def test_package_folder_alone_is_refused(tree: Path) -> None:
    (tree/"Makefile").unlink()
    done = setup(tree/"pywrap", "bdist_wheel")
    assert done.returncode != 0 and "Traceback" not in done.stderr
    assert "holds no Makefile and src_f90: point pip to the folder pywrap of a clone" in done.stderr
    assert not (tree/"build").exists()


def test_source_archive_is_refused(tree: Path) -> None:
    done = setup(tree/"pywrap", "sdist")
    assert done.returncode != 0 and "Traceback" not in done.stderr
    assert "pip wheel ./pywrap" in done.stderr
    assert not list(tree.rglob("*.tar.gz"))
