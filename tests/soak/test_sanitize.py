"""`make sanitize` tells what is planted: its flags, and its way of finding reports."""

import pathlib
import shutil
import subprocess
import sys

import pytest
import sanitize

sys.path.insert(0, str(pathlib.Path(__file__).resolve().parents[1]))

from test_make import Tree

MAIN = """program main
   use emcon_plants, only : outside, overflow, write_behind
   implicit none
   real, allocatable :: a(:)
   integer :: i
   character(len=12) :: word

   allocate(a(4))
   i = 2
   call get_command_argument(1, word)
   select case (word)
   case ("write_behind")
      call write_behind(5, a(:))
   case ("overflow")
      i = overflow(i)
   case ("outside")
      call outside(a, i)
   end select
   deallocate(a)
end program main
"""
PLANTS = """module emcon_plants
   use, intrinsic :: iso_c_binding, only : c_int
   implicit none
   private
   public :: outside, overflow, write_behind
   interface
      pure integer(c_int) function overflow(i) bind(c)
         import :: c_int
         integer(c_int), intent(in), value :: i
      end function overflow
   end interface
contains
   pure subroutine write_behind(n, x)
      integer, intent(in) :: n
      real, intent(out) :: x(n)

      x = 1
   end subroutine write_behind

   pure subroutine outside(a, i)
      real, intent(inout) :: a(:)
      integer, intent(in) :: i

      a(3*i) = 1
   end subroutine outside
end module emcon_plants
"""
PLANT_IN_C = "int overflow(int i);\nint overflow(int i) { return i + 2147483646; }\n"


@pytest.fixture(scope="module")
def program(tmp_path_factory):
    """Compiled by the rules of the Makefile, in a tree of its own."""
    if shutil.which("gcc") is None or "/" not in subprocess.run(
        ["gcc", "-print-file-name=libasan.so"], capture_output=True, text=True
    ).stdout:  # fmt: skip
        pytest.skip("there is no address sanitizer here")
    tree = Tree(tmp_path_factory.mktemp("tree"))
    tree.write("base/emcon_plants.f90", PLANTS)
    tree.write("base/emcon_plant.c", PLANT_IN_C)
    (tree.folder / "tests/kernels/main.F90").write_text(MAIN)
    tree.make("kernels", "MODE=sanitize")
    return tree.folder / "build/sanitize/kernels"


@pytest.mark.parametrize(
    "plant, code, told",
    [
        ("nothing", 0, ""),
        ("write_behind", 1, "heap-buffer-overflow"),
        ("overflow", 1, "signed integer overflow"),
        # Told by the run-time library of Fortran, and no report.
        ("outside", 2, ""),
    ],
)
def test_what_is_planted_is_told(program, tmp_path, plant, code, told):
    done = subprocess.run([program, plant], env=sanitize.environment(tmp_path),
                          capture_output=True, text=True)  # fmt: skip
    assert done.returncode == code, done.stdout + done.stderr
    text = "".join(sanitize.reports(tmp_path).values())
    assert told in text and bool(told) == bool(text)
    assert ("Fortran runtime error: Index '6'" in done.stderr) == (plant == "outside")


def test_a_report_is_a_failure(program, monkeypatch, capsys):
    """Also of a program whose caller is content with it."""
    monkeypatch.setattr(sys, "argv", ["sanitize.py", "kernels"])
    for plant, is_failure in (("write_behind", True), ("nothing", False)):
        command = ["sh", "-c", f"{program} {plant} || true"]
        monkeypatch.setattr(sanitize, "PARTS", {"kernels": command})
        assert sanitize.main() == is_failure
        assert ("emcon_plants.f90:17" in capsys.readouterr().out) == is_failure
