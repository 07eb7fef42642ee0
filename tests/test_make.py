"""What the rules of the Makefile compile, counted in a small tree of modules with these rules."""

import os
import pathlib
import re
import shutil
import subprocess
import sys

import pytest

ROOT = pathlib.Path(__file__).resolve().parents[1]

LOW = """module emcon_low
   implicit none
   private
   public :: twice
contains
   pure integer function twice(i)
      integer, intent(in) :: i

      twice = 2*i
   end function twice
end module emcon_low
"""


def user(name, used, call):
    """A module whose one function calls that of another."""
    return f"""module emcon_{name}
   use emcon_{used}, only : {call}
   implicit none
   private
   public :: {name}
contains
   pure integer function {name}(i)
      integer, intent(in) :: i
      include "{name}.inc"

      {name} = {call}(i) + one
   end function {name}
end module emcon_{name}
"""


class Tree:
    """A folder with the rules of this project and a chain of modules: low, middle, top; beside."""

    def __init__(self, folder):
        self.folder = folder
        for name in ("Makefile", ".ci/setup", "src_f90/module_order.py", "pyproject.toml"):
            (folder / name).parent.mkdir(parents=True, exist_ok=True)
            shutil.copy2(ROOT / name, folder / name)
        # What was found on this machine: nothing has to be looked for again.
        (folder / "build").mkdir()
        config = (ROOT / "build/config.mk").read_text().replace(f" {ROOT}\n", f" {folder}\n", 1)
        (folder / "build/config.mk").write_text(config)
        self.write("base/emcon_low.f90", LOW)
        for name, used, call in (
            ("middle", "low", "twice"), ("top", "middle", "middle"), ("beside", "low", "twice"),
        ):  # fmt: skip
            self.write(f"base/emcon_{name}.f90", user(name, used, call))
            self.write(f"base/{name}.inc", "      integer, parameter :: one = 1\n")
        main = folder / "tests/kernels/main.F90"
        main.parent.mkdir(parents=True)
        main.write_text("program main\n   use emcon_top, only : top\n   implicit none\n\n"
                        "   if (top(1) /= 4) error stop\nend program main\n")

    def write(self, name, text):
        path = self.folder / "src_f90" / name
        path.parent.mkdir(exist_ok=True)
        path.write_text(text)

    def run(self, *goals):
        environment = {k: v for k, v in os.environ.items() if k not in ("MAKEFLAGS", "MAKELEVEL")}
        # `timeout` of coreutils: it ends what make has started, too.
        return subprocess.run(["timeout", "120", "make", "V=1", *goals], cwd=self.folder,
                              env=environment, capture_output=True, text=True)  # fmt: skip

    def compiled(self, *goals):
        """The command lines of compilations that make prints, and the files they compile."""
        done = self.run(*goals)
        assert done.returncode == 0, done.stdout + done.stderr
        lines = re.findall(r"^(.* -c (\S+\.[fF]90) .*)$", done.stdout, re.M)
        return [(pathlib.Path(file).stem, line) for line, file in lines]

    def make(self, *goals):
        """Command lines of compilations by the file they compile."""
        return dict(self.compiled(*goals))


@pytest.fixture(scope="module")
def tree(tmp_path_factory):
    tree = Tree(tmp_path_factory.mktemp("tree"))
    assert set(tree.make("lib")) == {"emcon_low", "emcon_middle", "emcon_top", "emcon_beside"}
    return tree


def test_nothing_is_compiled_twice(tree):
    assert not tree.make("lib")


def test_an_edit_of_a_body_compiles_one_file(tree):
    tree.write("base/emcon_low.f90", LOW.replace("2*i", "i + i"))
    assert set(tree.make("lib")) == {"emcon_low"}
    assert not tree.make("lib")


def test_an_edit_of_an_interface_compiles_its_users(tree):
    """The direct ones: what these offer to others is what it was."""
    tree.write("base/emcon_low.f90", LOW.replace("pure integer", "elemental integer"))
    assert set(tree.make("lib")) == {"emcon_low", "emcon_middle", "emcon_beside"}
    assert not tree.make("lib")


def test_an_included_file_compiles_who_includes_it(tree):
    tree.write("base/top.inc", "      integer, parameter :: one = 0 + 1\n")
    assert set(tree.make("lib")) == {"emcon_top"}


def test_a_module_file_that_is_gone_is_made_again(tree):
    (tree.folder / "build/release/mod/emcon_low.mod").unlink()
    assert "emcon_low" in tree.make("lib")
    tree.write("base/emcon_middle.f90", user("middle", "low", "twice") + "! a last line\n")
    assert set(tree.make("lib")) == {"emcon_middle"}


def test_the_library_keeps_its_flags_below_the_kernel_tests(tree):
    """Those are not optimised; what is made on the way to them is."""
    tree.write("base/emcon_low.f90", LOW + "! another last line\n")
    commands = tree.make("kernels")
    assert " -O2 " in commands["emcon_low"] and " -O0 " not in commands["emcon_low"]
    assert " -O0 " in commands["main"]


def test_the_kernel_tests_are_compiled_once(tree):
    """With the checks of `debug`, and linked with the library of either mode."""
    tree.make("kernels")
    assert set(tree.make("MODE=debug", "kernels")) == {
        "emcon_beside", "emcon_low", "emcon_middle", "emcon_top",
    }  # fmt: skip
    (tree.folder / "tests/kernels/main.F90").touch()
    assert " -fcheck=all," in tree.make("MODE=debug", "kernels")["main"]
    assert not tree.make("kernels")


def test_the_other_licence_compiles_what_knows_of_it(tree):
    tree.write("algebra/emcon_solver_kinds.F90", LOW.replace("emcon_low", "emcon_solver_kinds"))
    assert "emcon_solver_kinds" in tree.make("lib", "kernels")
    found = tree.make("LICENSE=permissive", "lib", "kernels")
    assert set(found) == {"emcon_solver_kinds", "main"}
    assert all(" -DEMCON_PERMISSIVE " in line for line in found.values())
    assert " -O0 " in found["main"] and " -O0 " not in found["emcon_solver_kinds"]
    assert not tree.make("LICENSE=permissive", "lib", "kernels") and not tree.make("lib", "kernels")


LAWS = """module emcon_laws
   implicit none
   private
   public :: n_law
   interface
      !> How many there are.
      pure module integer function n_law()
      end function n_law
   end interface
end module emcon_laws
"""
KINDS = """submodule (emcon_laws) emcon_law_kinds
   implicit none
   integer, parameter :: code(*) = [1, 2]
contains
   module procedure n_law
      n_law = size(code)
   end procedure n_law
end submodule emcon_law_kinds
"""


def test_what_stands_in_a_submodule_compiles_one_file(tree):
    tree.write("laws/emcon_laws.f90", LAWS)
    tree.write("laws/emcon_law_kinds.f90", KINDS)
    tree.write("laws/emcon_law_more.f90", KINDS.replace("(emcon_laws)", "(emcon_laws:emcon_law_kinds)")
               .replace("emcon_law_kinds", "emcon_law_more", 3).replace(":emcon_law_more", ":emcon_law_kinds")
               .split("contains")[0] + "end submodule emcon_law_more\n")  # fmt: skip
    tree.write("base/emcon_top.f90", user("top", "laws", "n_law").replace("n_law(i)", "n_law()"))
    assert {"emcon_laws", "emcon_law_kinds", "emcon_law_more", "emcon_top"} <= set(tree.make("lib"))
    assert not tree.make("lib")
    tree.write("laws/emcon_laws.f90", LAWS + "! a last line\n")
    assert set(tree.make("lib")) == {"emcon_laws"}
    tree.write("laws/emcon_law_kinds.f90", KINDS.replace("[1, 2]", "[1, 2, 3]"))
    assert set(tree.make("lib")) == {"emcon_law_kinds", "emcon_law_more"}
    (tree.folder / "build/release/mod/emcon_laws.smod").unlink()
    assert "emcon_laws" in tree.make("lib")


def test_a_tag_of_a_source_chooses_its_flags(tree):
    """And those of a tag that are new compile the files that have it."""
    tree.write("base/emcon_beside.f90", "! build: streams\n" + user("beside", "low", "twice"))
    shared = user("middle", "low", "twice").replace("   pure integer", "   integer")
    shared = shared.replace("\n\n", "\n      !$omp parallel\n      !$omp end parallel\n")
    tree.write("base/emcon_middle.f90", shared)
    commands = tree.make("lib")
    assert set(commands) == {"emcon_beside", "emcon_middle"}
    assert " -O3 " in commands["emcon_beside"] and " -fopenmp-simd " in commands["emcon_beside"]
    assert " -O2 " in commands["emcon_middle"] and " -fopenmp " in commands["emcon_middle"]
    makefile = tree.folder / "Makefile"
    makefile.write_text(makefile.read_text().replace("FFLAGS_OF_streams := -O3", "FFLAGS_OF_streams := -O1"))
    assert set(tree.make("lib")) == {"emcon_beside"}
    assert not tree.make("lib")


@pytest.mark.parametrize("lines, says", [
    ("! build: lanes\n! Build: stream\n", ":2: there is no build tag 'stream'; there are: lanes, streams"),
    ("! build:\n", ":1: there is no build tag ''"),
    ("! build: lanes streams\n", ":1: there is no build tag 'lanes streams'"),
    ("! build: lanes\n! build: streams\n", ":2: the second build tag"),
])  # fmt: skip
def test_a_wrong_tag_is_refused(lines, says, tmp_path):
    source = tmp_path / "emcon_low.f90"
    script = [sys.executable, ROOT / "src_f90/module_order.py", "obj", "mod", "lanes streams", source]
    source.write_text("! build: lanes\n" + LOW)
    good = subprocess.run(script, capture_output=True, text=True, check=True)
    assert "TAGGED_lanes := emcon_low\n" in good.stdout
    source.write_text(lines + LOW)
    bad = subprocess.run(script, capture_output=True, text=True)
    assert bad.returncode == 1 and bad.stdout == "" and bad.stderr.startswith(f"{source}{says}")


def test_a_dry_run_ends_and_makes_nothing(tmp_path):
    """Each file is told once: a recipe that calls make would tell it on every way through it."""
    tree = Tree(tmp_path)
    library = ["emcon_beside", "emcon_low", "emcon_middle", "emcon_top"]
    assert sorted(name for name, _ in tree.compiled("--dry-run", "lib")) == library
    assert not list(tmp_path.rglob("*.o"))
    tree.make("lib")
    tree.write("base/emcon_low.f90", LOW.replace("2*i", "i + i"))
    assert set(tree.make("--dry-run", "lib")) >= {"emcon_low"}
    tree.make("lib")
    assert not tree.make("--dry-run", "lib")
    module = tmp_path / "build/release/mod/emcon_low.mod"
    module.unlink()
    assert "emcon_low" in tree.make("--dry-run", "lib")
    assert not module.exists()


@pytest.mark.parametrize("named", [(), ("HDF5_LIBS=-L/mine -lhdf5_of_mine",)], ids=["found", "named"])
def test_hdf5_of_programs_is_that_of_its_archives_or_the_one_named(named, tmp_path):
    """Each start would load all that a shared one needs; the library has the shared one."""
    tree = Tree(tmp_path)
    config = tmp_path / "build/config.mk"
    config.write_text(re.sub(r"^HDF5_APP_LIBS := .*", "HDF5_APP_LIBS := -lhdf5_archive", config.read_text(),
                             flags=re.M))  # fmt: skip
    text = tree.run("--dry-run", "lib", "kernels", *named).stdout.replace("\\\n", " ")
    (program,), (library,) = (re.findall(rf"^.* -o build/release/{name} .*$", text, re.M)
                              for name in ("kernels", r"libemcon\.so\.\S+"))
    if named:
        assert all(" -L/mine -lhdf5_of_mine " in line and "archive" not in line for line in (program, library))
    else:
        assert " -lhdf5_archive " in program and " -lhdf5_fortran " not in program
        assert " -lhdf5_fortran " in library and "archive" not in library
