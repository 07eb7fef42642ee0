"""What the rules of the Makefile compile, counted in a small tree of modules with these rules."""

import os
import pathlib
import re
import shutil
import subprocess

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

    def compiled(self, *goals):
        """The command lines of compilations that make prints, and the files they compile."""
        environment = {k: v for k, v in os.environ.items() if k not in ("MAKEFLAGS", "MAKELEVEL")}
        # `timeout` of coreutils: it ends what make has started, too.
        done = subprocess.run(["timeout", "120", "make", "V=1", *goals], cwd=self.folder,
                              env=environment, capture_output=True, text=True)  # fmt: skip
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
