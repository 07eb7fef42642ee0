"""Compile library, program and extension for the interpreter that pip runs in.

By the rules of the Makefile, whose sources stand beside this folder: wheels and source archives are
made of the whole tree.
"""

from __future__ import annotations

import atexit
import fcntl
import os
import shlex
import shutil
import subprocess
import sys
import sysconfig
import tempfile
from importlib import metadata
from pathlib import Path

from setuptools import Extension, setup
from setuptools.command.build_ext import build_ext
from setuptools.command.egg_info import FileList
from setuptools.command.sdist import sdist

ROOT = Path(__file__).resolve().parents[1]
#: What is compiled, and what stands beside it for programs in other languages.
MADE = ("libemcon.so.*", "bin/*", "include/*", "cmake/*")
#: What a source archive holds.
SOURCES = ("CHANGELOG.md", "CITATION.cff", "LICENSE", "Makefile", "README.md", "pyproject.toml",
           ".ci", "docs", "input_decks", "pywrap", "src_f90")

def demand(condition: bool, text: str) -> None:
    """End with `text`, the last line that pip shows, unless `condition` holds."""
    if not condition:
        sys.exit(f"error: {text}")


def check_tools() -> None:
    """Refuse what cannot work, before anything is compiled."""
    demand(shutil.which("make") is not None,
           "EMCON needs make; in Debian and Ubuntu: apt-get install make")
    try:
        numpy = metadata.version("numpy")
    except metadata.PackageNotFoundError:
        numpy = "none"
    demand(numpy != "none" and int(numpy.split(".")[0]) >= 2,
           f"EMCON is compiled with numpy 2 or newer, but {sys.executable} has {numpy}: "
           "pip install 'numpy >=2.0, <3', or leave out --no-build-isolation")


def make(objects: Path, package: Path) -> None:
    """Extension and library into the folder `package`; what is in between into `objects`."""
    # pip shows the packages of an isolated build by PYTHONPATH, which the Makefile takes away.
    python = shlex.quote(sys.executable)
    if "PYTHONPATH" in os.environ:
        python = f"PYTHONPATH={shlex.quote(os.environ['PYTHONPATH'])} {python}"
    # The jobs of a make that has called pip are not ours; its variables are in the environment.
    env = {name: value for name, value in os.environ.items()
           if name not in {"MAKEFLAGS", "MAKELEVEL", "MFLAGS"}}
    env.setdefault("PYTHON", sys.executable)
    env["EMCON_SETUP_INSTALLS"] = "no"  # pip changes an environment of Python, never the system
    env.setdefault("LICENSE", "permissive")  # what pip installs may be passed on with any program
    variables = {
        "PY": python,
        "PY_READY": "",
        "PYTHON_INCLUDE": sysconfig.get_path("include"),
        "EXT_SUFFIX": sysconfig.get_config_var("EXT_SUFFIX"),
        "P": os.path.relpath(objects, ROOT),
        "PACKAGE": os.path.relpath(package, ROOT),
    }
    package.mkdir(parents=True, exist_ok=True)
    with open(ROOT/"build"/".lock", "w", encoding="utf-8") as lock:
        fcntl.flock(lock, fcntl.LOCK_EX)  # the lock of `make run` and `make test`
        done = subprocess.run(["make", "--no-print-directory", f"-j{os.cpu_count() or 1}", "pywrap",
                               *(f"{name}={value}" for name, value in variables.items())],
                              cwd=ROOT, env=env, stdin=subprocess.DEVNULL, check=False)
    made = (package/f"_core{variables['EXT_SUFFIX']}").is_file() and all(any(package.glob(names)) for names in MADE)
    demand(done.returncode == 0 and made,
           "EMCON could not be compiled; the reason stands above")


class BuildExtension(build_ext):
    """`emcon._core` with the library beside it; in the source tree if that is to be used."""

    def run(self) -> None:
        check_tools()
        in_place = self.inplace or self.editable_mode
        make(SCRATCH/"py", (ROOT/"pywrap" if in_place else Path(self.build_lib))/"emcon")

    def get_output_mapping(self) -> dict[str, str]:
        mapping = super().get_output_mapping()
        if self.inplace:  # a strict editable installation links what stands here, nothing else
            package = ROOT/"pywrap"/"emcon"
            for file in (file for names in MADE for file in package.glob(names)):
                name = f"emcon/{file.relative_to(package)}"
                mapping[str(Path(self.build_lib)/name)] = f"pywrap/{name}"
        return mapping


def source_files() -> list[str]:
    """What a source archive holds: sources, without what was made of them."""
    made = {file for names in MADE for file in (ROOT/"pywrap"/"emcon").glob(names)}
    found = [file for name in SOURCES for file in (ROOT/name, *(ROOT/name).rglob("*"))
             if file.is_file() and file not in made and file.suffix not in {".so", ".pyc"}
             and not any(part in {"build", "dist"} or part.endswith(".egg-info")
                         for part in file.relative_to(ROOT).parts)]
    return sorted(str(file.relative_to(ROOT)) for file in found)


class SourceArchive(sdist):
    """All that wheels are made of; nothing that was made, nothing of tests."""

    def run(self) -> None:
        self.filelist = FileList()
        self.filelist.files = source_files()
        self.make_distribution()


demand((ROOT/"Makefile").is_file() and (ROOT/"src_f90").is_dir(),
       f"EMCON is compiled from its whole tree, but {ROOT} holds no Makefile and src_f90: "
       "point pip to a clone, or to a source archive")
demand(Path.cwd() == ROOT, f"point pip to {ROOT}, where pyproject.toml is")

# Nothing of an earlier build, perhaps of another interpreter, gets into this one.
(ROOT/"build").mkdir(exist_ok=True)
SCRATCH = Path(tempfile.mkdtemp(prefix="pip-", dir=ROOT/"build"))
atexit.register(shutil.rmtree, SCRATCH, ignore_errors=True)

setup(
    ext_modules=[Extension("emcon._core", sources=[])],
    cmdclass={"build_ext": BuildExtension, "sdist": SourceArchive},
    options={"build": {"build_base": str(SCRATCH)}, "egg_info": {"egg_base": str(SCRATCH)}},
)
