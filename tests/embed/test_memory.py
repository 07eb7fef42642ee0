"""Programs against the installed library touch no memory that is not theirs, and lose none.

All programs are one here, which runs them one after the other: so the library is looked at by
valgrind once, and what a program leaves behind would harm the next.
"""

from __future__ import annotations

from pathlib import Path

import pytest
from embed_tools import HERE, ROOT, SANITIZED, build, need, run
from scene_tools import generated
from test_interface_c import BAD_CALLS
from test_space_arrays import deck, flight

from contact_blocks import Pair, pressed   # whose folder is in the path by the tests before

DECKS = ROOT/"input_decks"
#: The programs, and the arguments of each of their runs; {} is a folder to write into.
RUNS = [
    # models of all formulations, one after the other
    ("impact.c", "{}/ring.inp", *(f"h=0.1\nt_end=0.2\nformulation={formulation}"
                                     for formulation in ("NODE TO SURFACE", "MORTAR", "SEGMENT"))),
    # arrays of exactly the size that is asked for, of the plane and of space
    ("exact_arrays.c", DECKS/"contact_patch.inp"),
    ("exact_arrays.c", "{}/block.inp"),
    ("exact_arrays.c", "{}/blocks.inp"),
    # of C and of Fortran 77: counts up to the largest integer are refused
    ("exact_interface.c",),
    ("query.c", DECKS/"bouncing_bar.inp"),
    ("bad_calls.c", DECKS/"bouncing_bar.inp", "{}"),
    # the impact is over after 100 steps
    ("contact_loop.c", "100"),
    ("interface_bars.c", "3", "100"),
    ("wrong_contact.c",),
    ("host_solid.c", "MORTAR", "0.05"),
    ("bad_given.c", "{}/given.h5"),
    ("fortran_host.f90", DECKS/"bouncing_bar.inp"),
    ("fortran_contact.f90",),
    ("fortran_solid.f90", "MORTAR", "0.05"),
]
DRIVER = """
#include <stdio.h>
#include <string.h>

{declarations}
typedef int run_main(int, char **);
static run_main *const known[] = {{ {names} }};

/* Each run is the number of a program and its arguments, up to a `--`. */
int main(int argc, char **argv)
{{
   for (int first = 1; first < argc;) {{
      int n = 0, which = 0;
      while (first + n < argc && strcmp(argv[first + n], "--") != 0) ++n;
      char *after = argv[first + n];
      argv[first + n] = NULL;
      sscanf(argv[first], "%d", &which);
      if (known[which](n, argv + first) != 0) return 1;
      argv[first + n] = after;
      first += n + 1;
   }}
   return 0;
}}
"""


def compiled(source: Path, folder: Path, env: dict[str, str]) -> Path:
    """An object whose `main` is called by the name of the program."""
    made, name = folder/f"{source.stem}.o", f"{source.stem}_main"
    is_fortran = source.suffix == ".f90"
    build("gfortran" if is_fortran else "cc", source, made, env, "-c", "-g",
          "-std=f2008" if is_fortran else "-std=c99")
    run("objcopy", f"--redefine-sym=main={name}", made)
    return made


def all_in_one(folder: Path, env: dict[str, str]) -> list[object]:
    """The program of all programs, and its arguments."""
    (folder/"wrong_contact.c").write_text(BAD_CALLS)
    deck(folder, flight("C3D8"))
    (folder/"blocks.inp").write_text(Pair(("C3D8", "C3D8"), (1, 2)).deck(pressed()))
    # Two nodes of the ring in contact, on the fewest elements.
    (folder/"ring.inp").write_text(generated("make_ring", "--ring", "32x1", "--block", "20x1"))
    files = list(dict.fromkeys(name for name, *_ in RUNS))
    sources = [folder/name if (folder/name).exists() else HERE/name for name in files]
    objects = [compiled(source, folder, env) for source in sources]
    names = [f"{source.stem}_main" for source in sources]
    (folder/"driver.c").write_text(DRIVER.format(
        declarations="\n".join(f"int {name}(int, char **);" for name in names),
        names=", ".join(names)))
    build("cc", folder/"driver.c", folder/"programs", env, "-std=c99", *map(str, objects),
          "-lgfortran")
    arguments: list[object] = []
    for name, *given in RUNS:
        arguments += [files.index(name), *(str(text).replace("{}", str(folder)) for text in given),
                      "--"]
    return [folder/"programs", *arguments]


def test_no_memory_is_lost(installed: dict[str, str], tmp_path: Path) -> None:
    """No invalid access and no bytes lost, by valgrind or by the sanitizer in the library."""
    need("objcopy")
    command = all_in_one(tmp_path, installed)
    if not SANITIZED:
        need("valgrind")
        command = ["valgrind", "--leak-check=full", "--errors-for-leak-kinds=definite",
                   "--error-exitcode=9", "--quiet", *command]
    run(*command, env=installed)
