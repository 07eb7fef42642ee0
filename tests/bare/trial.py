"""The first hour on a machine that has nothing: `sudo python3 tests/bare/trial.py [WHEEL...] [--source]`

Bare folders of Debian 12 and Ubuntu 24.04 (debootstrap) with Python and without a compiler. In
each: `pip install` of the wheel that fits its Python, the lines of README.md, the scenes that are
drawn in Gmsh from script to picture, in under two minutes each; then CMake and a compiler, and the
host in C++ from the files of the wheel; with --prefix also from an installed one. Says seconds,
those of the processor (user and system) and the load of the machine. Where the machine is loaded
with other work, the two minutes are judged by the seconds of the processor. Ends with 1 where
something fails.

With --source: the first lines of README.md, typed: `git clone`, `cd`, and `make run` by phases. The
folders for this are others, and their compilers stay; where such a folder is new, system packages
are installed too.

It needs root, debootstrap, and a network; folders that are there already are used again.
"""

from __future__ import annotations

import argparse
import os
import re
import shutil
import subprocess
import sys
import time
from collections.abc import Callable
from dataclasses import dataclass
from pathlib import Path

ROOT = Path(__file__).resolve().parents[2]
#: A scene from script to picture [s].
LIMIT = 120.0
SCENES = ("bumper", "oring", "press_fit")
#: Libraries of the desktop that gmsh and VTK ask for, even where nothing is shown.
SHOWN = ["libglu1-mesa", "libgl1", "libxrender1", "libxcursor1", "libxft2", "libxinerama1",
         "libxfixes3", "libgomp1", "libegl1"]
#: Of an installed prefix, by the names of Debian 12.
LIBRARIES = ["libhdf5-103-1", "libhdf5-fortran-102", "libumfpack5", "libamd2", "libmetis5",
             "libmumps-seq-5.5", "libopenblas0", "libgfortran5", "libgomp1"]


@dataclass
class System:
    """A system that debootstrap can put into a folder."""

    name: str
    release: str
    #: Script of debootstrap, where it may not know the release.
    script: str
    python: str


SYSTEMS = {system.name: system for system in (
    System("debian", "bookworm", "sid", "cp311"),
    System("ubuntu", "noble", "gutsy", "cp312"))}


class Bare:
    """A folder with a system in it, and what is run there."""

    def __init__(self, system: System, folder: Path) -> None:
        self.system, self.folder = system, folder
        self.failed: list[str] = []

    def set_up(self) -> None:
        is_unfinished = (self.folder/"debootstrap").exists()
        if is_unfinished:
            shutil.rmtree(self.folder)
        if is_unfinished or not (self.folder/"usr"/"bin"/"python3").exists():
            known = Path("/usr/share/debootstrap/scripts")
            keys = list(Path("/usr/share/keyrings").glob(f"{self.system.name}-*"))
            command = ["debootstrap", *([] if keys else ["--no-check-gpg"]), "--variant=minbase",
                       f"--components=main{',universe' if self.system.name == 'ubuntu' else ''}",
                       "--include=python3,python3-venv,ca-certificates", self.system.release,
                       str(self.folder)]
            if not (known/self.system.release).exists():
                command += ["", str(known/self.system.script)]
            subprocess.run(command, check=True, stdout=subprocess.DEVNULL)
        for name in ("etc/resolv.conf", "etc/ssl/certs/ca-certificates.crt"):
            shutil.copy(f"/{name}", self.folder/name)
        for kind, place in (("proc", "proc"), ("tmpfs", "dev/shm")):
            (self.folder/place).mkdir(exist_ok=True)
            if not os.path.ismount(self.folder/place):
                subprocess.run(["mount", "-t", kind, kind, str(self.folder/place)], check=True)
        shutil.rmtree(self.folder/"trial", ignore_errors=True)
        (self.folder/"trial").mkdir()

    def leave(self) -> None:
        for place in ("dev/shm", "proc"):
            subprocess.run(["umount", str(self.folder/place)], check=False)

    def run(self, what: str, command: str, limit: float = 0.0) -> None:
        """Run a line in the folder /trial; say what, seconds, and the last line that it prints."""
        env = {"HOME": "/root", "LANG": "C.UTF-8", "DEBIAN_FRONTEND": "noninteractive",
               "MPLBACKEND": "agg", "PATH": "/trial/env/bin:/usr/local/sbin:/usr/local/bin:"
               "/usr/sbin:/usr/bin:/sbin:/bin"}
        start, before = time.monotonic(), os.times()
        done = subprocess.run(["chroot", str(self.folder), "sh", "-ec", f"cd /trial; {command}"],
                              env=env, text=True, stdout=subprocess.PIPE, stderr=subprocess.STDOUT)
        seconds = elapsed = time.monotonic() - start
        after = os.times()
        busy = max(0.0, after.children_user + after.children_system
                   - before.children_user - before.children_system)
        # Where others hold the processors too, only the time of the processor says anything.
        if os.getloadavg()[0] > 2*(os.cpu_count() or 1):
            seconds = min(seconds, busy)
        is_good = done.returncode == 0 and (not limit or seconds < limit)
        last = (done.stdout.strip().splitlines() or [""])[-1]
        print(f"{self.system.name:8}{what:34}{elapsed:7.1f} s, busy {busy:5.1f} s, "
              f"load {os.getloadavg()[0]:4.1f}  "
              f"{'' if is_good else 'FAILED  '}{last[:80]}", flush=True)
        if not is_good:
            self.failed.append(what)
            print("\n".join(f"    {line}" for line in done.stdout.strip().splitlines()[-12:]),
                  flush=True)


def scenes(bare: Bare, wheel: Path) -> None:
    """The wheel, the lines of README.md for it, and the scenes of Gmsh."""
    shutil.copy(wheel, bare.folder/"trial")
    shutil.copytree(ROOT/"input_decks", bare.folder/"trial"/"input_decks")
    bare.run("apt-get install, to show", "apt-get update -q && apt-get install -qy "
             f"--no-install-recommends {' '.join(SHOWN)}")
    bare.run("apt-get purge, of a trial before",
             "apt-get autoremove --purge -qy cmake g++ make || apt-get check")
    bare.run("no compiler", "! command -v cc gcc g++ gfortran make cmake")
    readme = (ROOT/"README.md").read_text()
    lines = re.findall(r"^    (python3 -m venv env|\. env\S+|pip install emcon-\S+)", readme, re.MULTILINE)
    assert len(lines) == 3
    for line in lines:
        bare.run(line, line)
    bare.run("emcon RING", "emcon input_decks/ring.inp --set h=0.05 --output run")
    bare.run("emcon summary, plot", "emcon summary run/ring && emcon plot run/ring")
    bare.run("a stepper", "python -c \"import emcon; "
             "s = emcon.Stepper('input_decks/ring.inp', h=0.05, t_end=1); "
             "s.run(output='stepped'); print(s.energies()['total'])\"")
    wheels = " ".join(f"'{part}'" for part in ("gmsh", f"./{wheel.name}[mesh]", "pyvista"))
    bare.run("pip install gmsh pyvista", f"pip install -q {wheels}")
    for scene in SCENES:
        bare.run(f"gmsh_{scene}.py", f"python input_decks/gmsh_{scene}.py {scene}", LIMIT)
        bare.run("  its picture", f"test -s {scene}/gmsh_{scene}.png")


def source(bare: Bare) -> None:
    """The first lines of README.md on what is committed; `make run` by phases."""
    subprocess.run(["git", "clone", "-q", "--bare", str(ROOT), str(bare.folder/"trial"/"served")],
                   check=True)
    bare.run("apt-get install git make",
             "apt-get update -q && apt-get install -qy --no-install-recommends git make")
    readme = (ROOT/"README.md").read_text()
    (clone,) = re.findall(r"^    (git clone ADDRESS emcon) ", readme, re.MULTILINE)
    bare.run(clone, clone.replace("ADDRESS", "served"))
    for what, command in (("system packages", ".ci/setup system"), ("program", "make -j$(nproc) app"),
                          ("Python packages", ".ci/setup python run"), ("Python extension", "make -j$(nproc) pywrap"),
                          ("scene and picture", "make run && test -s build/run/ring.png")):
        bare.run(f"make run: {what}", f"cd emcon && {command}")


def hosts(bare: Bare, prefix: Path | None) -> None:
    """The host in C++ by CMake, from the wheel, and from an installed prefix."""
    shutil.copytree(ROOT/"tests"/"embed"/"cmake", bare.folder/"trial"/"host")
    bare.run("apt-get install cmake g++",
             "apt-get install -qy --no-install-recommends cmake g++ make")
    bare.run("host of the wheel", "cmake -S host -B of_wheel -Demcon_DIR=$(python -c "
             "'import emcon; print(emcon.get_cmake_dir())') && cmake --build of_wheel && "
             "of_wheel/border input_decks/ring.inp && of_wheel/blocks mortar 0.3 12")
    if not prefix:
        return
    shutil.copytree(prefix, bare.folder/"trial"/"a prefix", symlinks=True)
    bare.run("libraries of the prefix",
             f"apt-get install -qy --no-install-recommends {' '.join(LIBRARIES)}")
    bare.run("host of a prefix", "cmake -S host -B of_prefix -DCMAKE_PREFIX_PATH='/trial/a prefix'"
             " && cmake --build of_prefix --target border && of_prefix/border input_decks/ring.inp")


def tried(bare: Bare, trial: Callable[[Bare], object]) -> list[str]:
    """What of a trial failed."""
    bare.folder.mkdir(parents=True, exist_ok=True)
    try:
        bare.set_up()
        trial(bare)
    finally:
        bare.leave()
    return [f"{bare.system.name}: {what}" for what in bare.failed]


def main() -> int:
    parser = argparse.ArgumentParser(description=__doc__.split("\n")[0])
    parser.add_argument("wheel", nargs="*", type=Path, metavar="WHEEL")
    parser.add_argument("--source", action="store_true", help="time `make run` of a clone")
    parser.add_argument("--system", choices=SYSTEMS, nargs="+", default=list(SYSTEMS))
    parser.add_argument("--folder", type=Path, metavar="FOLDER", default=ROOT/"build"/"bare",
                        help="holds a folder for each system")
    parser.add_argument("--prefix", type=Path, metavar="FOLDER",
                        help="of `make install` on Debian 12, tried there too")
    options = parser.parse_args()
    if not (options.wheel or options.source):
        parser.error("give wheels, or --source")
    failed = []
    for system in (SYSTEMS[name] for name in options.system):
        if options.source:
            failed += tried(Bare(system, options.folder/f"{system.name}-source"), source)
        if not options.wheel:
            continue
        fitting = [wheel for wheel in options.wheel if f"-{system.python}-" in wheel.name]
        if not fitting:
            sys.exit(f"error: no wheel for {system.python}, the Python of {system.name}")
        prefix = options.prefix if system.name == "debian" else None
        failed += tried(Bare(system, options.folder/system.name),
                        lambda bare, wheel=fitting[0], prefix=prefix: (scenes(bare, wheel), hosts(bare, prefix)))
    print("all is well" if not failed else f"failed: {', '.join(failed)}")
    return 1 if failed else 0


if __name__ == "__main__":
    sys.exit(main())
