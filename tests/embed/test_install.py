"""`pip install .`: a wheel is complete, made for one interpreter, and runs on its own."""

from __future__ import annotations

import hashlib
import json
import os
import re
import shutil
import stat
import subprocess
import sys
import sysconfig
import tarfile
import tomllib
import zipfile
from pathlib import Path

import pytest

ROOT = Path(__file__).parents[2]
PACKAGE = ROOT/"pywrap"
sys.path.insert(0, str(PACKAGE))

from embed_tools import need, run  # noqa: E402
from emcon.stepper import Stepper  # noqa: E402

RING = ROOT/"input_decks"/"ring.inp"
PROJECT = tomllib.loads((ROOT/"pyproject.toml").read_text(encoding="utf-8"))["project"]
VERSION = PROJECT["version"]
BESIDE = {"emcon/py.typed", "emcon/_core.pyi", "emcon/include/emcon.h", "emcon/include/emcon.hpp",
          "emcon/cmake/emconConfig.cmake", "emcon/cmake/emconConfigVersion.cmake"}
LIBRARY = f"libemcon.so.{'.'.join(VERSION.split('.')[:2 if VERSION.startswith('0.') else 1])}"
COMPILED = {f"emcon/_core{sysconfig.get_config_var('EXT_SUFFIX')}", f"emcon/{LIBRARY}",
            "emcon/bin/emcon"}
#: Libraries under the GPL, without an exception for what uses them, that a build could be linked with.
GPL = re.compile(r"umfpack|cholmod|spqr|klu|readline|fftw|gsl", re.IGNORECASE)
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
	test "$(EMCON_SETUP_INSTALLS)" = no
	$(PY) -c 'import numpy'
	echo made > $(PACKAGE)/_core$(EXT_SUFFIX)
	mkdir -p $(PACKAGE)/bin $(PACKAGE)/include $(PACKAGE)/cmake
	for name in LIBRARY bin/emcon BESIDE; do echo made > $(PACKAGE)/$$name; done
""".replace("LIBRARY", LIBRARY).replace("BESIDE", " ".join(
    sorted(name.removeprefix("emcon/") for name in BESIDE if name.count("/") > 1)))


def pip_wheel(package: Path, into: Path, **env: str) -> subprocess.CompletedProcess[str]:
    """A wheel with what .venv has: no network, no environment of its own."""
    return subprocess.run([sys.executable, "-m", "pip", "wheel", "--no-build-isolation",
                           "--no-deps", "--no-index", "--wheel-dir", into, package],
                          env=os.environ | env, capture_output=True, text=True)


def setup(tree: Path, command: str, **env: str) -> subprocess.CompletedProcess[str]:
    return subprocess.run([sys.executable, "pywrap/setup.py", command], cwd=tree,
                          env=os.environ | env, capture_output=True, text=True)


def files(folder: Path, pattern: str = "*") -> set[str]:
    return {str(path.relative_to(folder)) for path in folder.rglob(pattern) if path.is_file()}


def python_files(package: Path) -> set[str]:
    return {name for name in files(package, "*.py") if name.startswith("emcon/")}


@pytest.fixture(scope="module")
def wheel(tmp_path_factory: pytest.TempPathFactory) -> Path:
    folder = tmp_path_factory.mktemp("wheel")
    done = pip_wheel(ROOT, folder)
    assert done.returncode == 0, done.stdout + done.stderr
    (file,) = folder.iterdir()
    return file


@pytest.fixture
def tree(tmp_path: Path) -> Path:
    """A source tree with products of another interpreter in it, and a Makefile that is quick."""
    shutil.copytree(PACKAGE, tmp_path/"tree"/"pywrap",
                    ignore=shutil.ignore_patterns("_core*.so", "libemcon*", "__pycache__", "build",
                                                  "bin", "include", "cmake", "dist", "*.egg-info"))
    package = tmp_path/"tree"/"pywrap"
    (tmp_path/"tree"/"src_f90").mkdir()
    (tmp_path/"tree"/"src_f90"/"source.f90").write_text("")
    for name in ("pyproject.toml", "README.md", "LICENSE"):
        shutil.copy(ROOT/name, tmp_path/"tree")
    (tmp_path/"tree"/"Makefile").write_text(MAKEFILE)
    (package/"emcon.egg-info").mkdir()
    listed = ["setup.py", *python_files(package)]
    stale = ["emcon/_core.cpython-36m-x86_64-linux-gnu.so", "emcon/libemcon.so.0", *COMPILED]
    for name in {*stale, "build/lib/emcon/gone.py", "emcon/_core.so"}:
        (package/name).parent.mkdir(parents=True, exist_ok=True)
        (package/name).write_text("stale\n")
    (package/"emcon.egg-info"/"SOURCES.txt").write_text("\n".join([*listed, *stale]))
    return tmp_path/"tree"


@pytest.mark.parametrize("installs", [False, True])
def test_system_packages(installs: bool, tmp_path: Path) -> None:
    """Not by pip, which names the line to type; by make, which says before what it installs."""
    (tmp_path/".ci").mkdir()
    shutil.copy(ROOT/".ci"/"setup", tmp_path/".ci")
    (tmp_path/"build").mkdir()
    called = tmp_path/"called"
    for name in ("apt-get", "sudo"):
        (tmp_path/name).write_text(f'#!/bin/sh\necho "$@" >> {called}\n')
        (tmp_path/name).chmod(0o755)
    done = subprocess.run(["sh", ".ci/setup", "system"], cwd=tmp_path, capture_output=True, text=True,
                          env=os.environ | {"PATH": f"{tmp_path}:{os.environ['PATH']}", "FC": "no_such",
                                            "CC": "no_such", "EMCON_SETUP_INSTALLS": "" if installs else "no"})
    assert done.returncode != 0
    assert called.exists() == installs
    assert "apt-get install -y --no-install-recommends " in done.stderr and "gfortran" in done.stderr
    assert ("installs them now: " in done.stderr) == installs


def test_builds_use_pinned_versions() -> None:
    """What pip builds with is what .ci/pins has."""
    pins = (ROOT/".ci"/"pins"/"test.txt").read_text(encoding="utf-8")
    needs = tomllib.loads((ROOT/"pyproject.toml").read_text(encoding="utf-8"))["build-system"]["requires"]
    pinned = {line.rstrip(" \\").replace(" ", "") for line in pins.splitlines() if "==" in line and line[0].isalpha()}
    assert {"setuptools", "numpy"} == {need.split("==")[0].strip() for need in needs}
    assert all(need.replace(" ", "") in pinned for need in needs)


def test_wheel_is_complete_and_for_this_interpreter(wheel: Path) -> None:
    names = set(zipfile.ZipFile(wheel).namelist())
    within = {name for name in names if name.startswith("emcon/")}
    assert within == python_files(PACKAGE) | COMPILED | BESIDE
    assert {name.split("/")[0] for name in names} == {"emcon", f"emcon-{VERSION}.dist-info"}
    tag = f"cp{sys.version_info.major}{sys.version_info.minor}"
    (program,) = (entry for entry in zipfile.ZipFile(wheel).infolist()
                  if entry.filename == "emcon/bin/emcon")
    assert program.external_attr >> 16 & stat.S_IXUSR
    platform = sysconfig.get_platform().replace("-", "_")
    assert wheel.name == f"emcon-{VERSION}-{tag}-{tag}{sys.abiflags}-{platform}.whl"


def test_unpacked_wheel_gives_what_the_tree_gives(wheel: Path, tmp_path: Path) -> None:
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
        energies = ring.energies()
    # To round-off: MUMPS factorises what UMFPACK does in the tree.
    scale = 1e3*sys.float_info.epsilon*max(map(abs, energies.values()))
    assert found["energies"] == pytest.approx(energies, rel=0, abs=scale)


def needed(file: Path) -> set[str]:
    """The libraries that a library or program asks for by itself."""
    return set(re.findall(r"\(NEEDED\).*\[(.+)\]", run("readelf", "--dynamic", "--wide", file)))


def test_no_part_of_a_wheel_is_under_the_gpl(wheel: Path, tmp_path: Path) -> None:
    """Of SuiteSparse, AMD alone; the only library here that is neither asked for nor loaded is UMFPACK."""
    need("readelf")
    with zipfile.ZipFile(wheel) as archive:
        archive.extractall(tmp_path)
    for name in COMPILED:
        assert not GPL.search(" ".join(needed(tmp_path/name))), name
        symbols = run("readelf", "--symbols", "--dyn-syms", "--wide", tmp_path/name)
        assert not re.search(r"\b(umfpack_d|umf_d|cholmod_|spqr|klu_)", symbols), name
    loaded = run("ldd", tmp_path/"emcon"/LIBRARY)
    assert not GPL.search(loaded) and "libamd" in loaded and "libmetis" in loaded
    assert "GPL" not in zipfile.ZipFile(wheel).read(f"emcon-{VERSION}.dist-info/METADATA").decode().split("\n\n")[0]


@pytest.mark.parametrize("file", [pytest.param(path, id=path.name) for path in sorted((ROOT/"build"/"dist").glob("*.whl"))])
def test_libraries_of_a_wheel_that_others_install(file: Path) -> None:
    """What .ci/wheels.py has made, where it has: each library with its licence, in the metadata and in the bill."""
    archive = zipfile.ZipFile(file)
    names = archive.namelist()
    info = next(name for name in names if name.endswith("/METADATA")).rsplit("/", 1)[0]
    held = {re.sub(r"-[0-9a-f]{8}(?=[.-])", "", Path(name).name): name for name in names
            if name.startswith("emcon.libs/") and ".so" in name}
    assert not GPL.search(" ".join(names)) and held
    bill = {part["name"]: part for part in json.loads(archive.read(f"{info}/sboms/emcon.cdx.json"))["components"]}
    assert set(bill) == {*held, "libhdf5"}
    stated = re.search(r"^License-Expression: (.*)$", archive.read(f"{info}/METADATA").decode(), re.MULTILINE)[1]
    terms = set(stated.split(" AND "))
    assert not [term for term in terms if term.startswith("GPL") and "WITH GCC-exception" not in term]
    texts = [Path(name).stem for name in names if name.startswith(f"{info}/licenses/")]
    for name, part in bill.items():
        assert set(part["licenses"][0]["expression"].split(" AND ")) <= terms and part["version"]
        assert any(name.startswith(text) for text in texts), name
        if name in held:
            assert part["hashes"][0]["content"] == hashlib.sha256(archive.read(held[name])).hexdigest(), name
    assert "manylinux" in file.name and file.stat().st_size < 12e6


def test_nothing_slips_in_or_is_left(tree: Path, tmp_path: Path) -> None:
    before = files(tree)
    done = pip_wheel(tree, tmp_path, MAKEFLAGS="n -- THEIRS=theirs")
    assert done.returncode == 0, done.stdout + done.stderr
    (file,) = tmp_path.glob("*.whl")
    with zipfile.ZipFile(file) as archive:
        within = {name for name in archive.namelist() if name.startswith("emcon/")}
        assert within == python_files(PACKAGE) | COMPILED | BESIDE
        assert all(archive.read(name) == b"made\n" for name in COMPILED)
    # What Python keeps of a compiled back end is Python's.
    left = {name for name in files(tree) if "__pycache__" not in name}
    assert left == before | {"build/.lock"}


def test_reason_of_a_failed_build_is_the_last_that_pip_shows(tree: Path, tmp_path: Path) -> None:
    (tree/"Makefile").write_text("$(error EMCON needs the packages gfortran)\npywrap:\n")
    done = pip_wheel(tree, tmp_path)
    text = done.stdout + done.stderr
    assert done.returncode != 0 and "Traceback" not in text
    assert text.index("EMCON needs the packages gfortran") < text.index(
        "error: EMCON could not be compiled; the reason stands above")
    assert not list(tmp_path.glob("*.whl")) and not list((tree/"build").glob("pip-*"))


def test_wheel_without_an_extension_is_refused(tree: Path) -> None:
    (tree/"Makefile").write_text(".PHONY: pywrap\n")
    done = setup(tree, "bdist_wheel")
    assert done.returncode != 0 and "error: EMCON could not be compiled" in done.stderr
    assert not list(tree.rglob("*.whl"))


def test_old_numpy_is_refused(tree: Path, tmp_path: Path) -> None:
    (tmp_path/"numpy-1.26.4.dist-info").mkdir()
    (tmp_path/"numpy-1.26.4.dist-info"/"METADATA").write_text("Name: numpy\nVersion: 1.26.4\n")
    done = setup(tree, "bdist_wheel", PYTHONPATH=str(tmp_path))
    assert done.returncode != 0 and "Traceback" not in done.stderr
    assert f"{sys.executable} has 1.26.4: pip install 'numpy >=2.0, <3'" in done.stderr


def test_package_folder_alone_is_refused(tree: Path) -> None:
    (tree/"Makefile").unlink()
    done = setup(tree, "bdist_wheel")
    assert done.returncode != 0 and "Traceback" not in done.stderr
    assert "holds no Makefile and src_f90: point pip to a clone" in done.stderr
    assert not (tree/"build").exists()


def test_the_folder_of_the_package_is_no_place_for_pip(tree: Path) -> None:
    done = subprocess.run([sys.executable, "setup.py", "bdist_wheel"], cwd=tree/"pywrap",
                          capture_output=True, text=True)
    assert done.returncode != 0 and f"point pip to {tree}" in done.stderr


def test_source_archive_holds_sources_only(tree: Path, tmp_path: Path) -> None:
    """All that a wheel is made of, none of what was made: a wheel of it is one of the tree."""
    done = setup(tree, "sdist")
    assert done.returncode == 0, done.stderr
    (archive,) = (tree/"dist").glob("*.tar.gz")
    with tarfile.open(archive) as packed:
        packed.extractall(tmp_path/"unpacked", filter="data")
    top = tmp_path/"unpacked"/f"emcon-{VERSION}"
    expected = {"LICENSE", "Makefile", "README.md", "pyproject.toml", "src_f90/source.f90",
                "pywrap/setup.py", "pywrap/build_backend.py",
                *(f"pywrap/{name}" for name in python_files(PACKAGE) | BESIDE
                  if name.count("/") == 1 or name.endswith(".py"))}
    assert files(top) == expected | {"PKG-INFO", "setup.cfg", "pywrap/make_pyf.py"}
    done = pip_wheel(top, tmp_path)
    assert done.returncode == 0, done.stdout + done.stderr


def test_the_source_archive_of_the_project(tmp_path: Path) -> None:
    done = subprocess.run([sys.executable, "-c", "import build_backend, sys; "
                           "build_backend.build_sdist(sys.argv[1])", tmp_path], cwd=ROOT,
                          env=os.environ | {"PYTHONPATH": str(PACKAGE)}, capture_output=True,
                          text=True)
    assert done.returncode == 0, done.stderr
    (archive,) = tmp_path.glob("*.tar.gz")
    with tarfile.open(archive) as packed:
        names = {name.split("/", 1)[1] for name in packed.getnames() if "/" in name}
        metadata = packed.extractfile(f"emcon-{VERSION}/PKG-INFO").read().decode()
    listed = subprocess.run(["git", "ls-files", "src_f90", "pywrap", "Makefile", ".ci"], cwd=ROOT,
                            capture_output=True, text=True).stdout.split()
    assert set(listed) <= names
    assert not [name for name in names if name.endswith((".so", ".o", ".mod", ".pyc"))]
    assert "License-Expression: BSD-3-Clause" in metadata and archive.stat().st_size < 10e6


def test_the_recipe_of_conda_says_what_the_project_says() -> None:
    """Version, summary, and the bounds of what it needs; matplotlib goes by another name there."""
    recipe = (ROOT/".ci"/"conda"/"recipe.yaml").read_text(encoding="utf-8")
    assert f'version: "{VERSION}"' in recipe and f"summary: {PROJECT['description']}" in recipe
    run_time = recipe.split("  run:\n")[1].split("\n\n")[0].replace("matplotlib-base", "matplotlib")
    asked = sorted(line.removeprefix("    - ").replace(" ", "") for line in run_time.splitlines())
    needed = [name.replace(" ", "").replace(">=2.0,", ">=2,") for name in PROJECT["dependencies"]]
    assert asked == sorted([*needed, "python"])
    assert PROJECT["requires-python"] == ">=3.11" and '"<3.11"' in recipe


def test_the_program_of_an_unpacked_wheel(wheel: Path, tmp_path: Path) -> None:
    """The command `emcon` of a wheel runs, checks, draws and tells of what there is not."""
    folder = tmp_path/"unpacked"
    with zipfile.ZipFile(wheel) as archive:
        archive.extractall(folder)
    (folder/"emcon"/"bin"/"emcon").chmod(0o755)             # as pip does
    env = NO_PATH | {"PYTHONPATH": str(folder), "PATH": "/usr/bin:/bin"}

    def emcon(*arguments: object) -> subprocess.CompletedProcess[str]:
        return subprocess.run([sys.executable, "-m", "emcon", *arguments], cwd=tmp_path, env=env,
                              capture_output=True, text=True)

    assert emcon("--version").stdout.startswith(f"emcon {VERSION}")
    help_text = emcon().stdout
    assert "--output DIR" in help_text and "emcon mesh " in help_text
    assert "unknowns" in emcon("check", RING).stdout
    done = emcon(RING, "--set", "t_end=0.1", "--output", tmp_path)
    assert done.returncode == 0 and "verdict: good" in done.stdout
    assert emcon("restart", "ring.rst.h5", "--output", tmp_path/"on", "--until", "0.2").returncode == 0
    assert "ring:" in emcon("summary", "ring").stdout
    assert emcon("plot", "ring").returncode == 0 and (tmp_path/"ring.png").is_file()
    done = emcon("plto", "ring")
    assert done.returncode == 2 and "did you mean plot?" in done.stderr
    assert emcon("run", "none.inp").returncode == 2
    (folder/"emcon"/"bin"/"emcon").unlink()
    done = emcon("check", RING)
    assert done.returncode == 4 and "no compiled program" in done.stderr


def test_a_host_in_cpp_by_the_files_of_a_wheel(wheel: Path, tmp_path: Path) -> None:
    need("cmake")
    with zipfile.ZipFile(wheel) as archive:
        archive.extractall(tmp_path/"a folder")
    told = subprocess.run([sys.executable, "-c", "import emcon; print(emcon.get_cmake_dir(), "
                           "emcon.get_include(), emcon.get_library(), sep='\\n')"],
                          env=NO_PATH | {"PYTHONPATH": str(tmp_path/"a folder")},
                          capture_output=True, text=True, check=True).stdout.splitlines()
    run("cmake", "-S", ROOT/"tests"/"embed"/"cmake", "-B", tmp_path/"host", f"-Demcon_DIR={told[0]}")
    run("cmake", "--build", tmp_path/"host")
    assert len(run(tmp_path/"host"/"border", RING).split()) == 2
    run("cc", ROOT/"tests"/"embed"/"impact.c", f"-I{told[1]}", told[2], "-o", tmp_path/"impact",
        f"-Wl,-rpath,{Path(told[2]).parent}")
    assert run(tmp_path/"impact", RING, "h=0.05\nt_end=0.1").startswith("1 ")


def test_meshes_become_cards(tmp_path: Path) -> None:
    """`emcon mesh IN OUT`: what is read is what is written, scaled and refined."""
    from emcon.mesh import block, read

    block((0.0, 0.0), (2.0, 1.0), (4, 2)).write(tmp_path/"in.inp")

    def mesh(*arguments: object) -> subprocess.CompletedProcess[str]:
        return subprocess.run([sys.executable, "-m", "emcon", "mesh", *arguments], cwd=tmp_path,
                              env=NO_PATH | {"PYTHONPATH": str(PACKAGE)}, capture_output=True,
                              text=True)

    done = mesh("in.inp", "out.inp", "--scale", "0.5", "--refine", "1")
    assert done.returncode == 0 and "BLOCK_TOP" in done.stdout
    found = read(tmp_path/"out.inp")
    assert len(found.elements["CPE4"]) == 32 and found.nodes.max(axis=0).tolist() == [1.0, 0.5]
    for arguments, reason in ((("none.msh", "out.inp"), "there is no file none.msh"),
                              (("in.inp", "out.vtk"), "name it NAME.inp")):
        done = mesh(*arguments)
        assert done.returncode == 2 and reason in done.stderr and "Traceback" not in done.stderr
