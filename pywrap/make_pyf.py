"""Write the signature file of the Python extension, from the header of the C library.

    python make_pyf.py HEADER > _core.pyf

Each function of the header becomes one of the extension, with its name. It returns the status, or
what else the C function returns, and then what C writes. Handles, functions and texts of the
library are addresses; counts that an input array tells are left out, and further extents
that the model tells (n_dim). The size of an array stands
behind it in the header: `double *u /* n_node x 2 */`. An input that may be NULL is so where it has
no entries, one of several output arrays where `no_u=1` is given. Structures are bytes; the constant
STRUCTURES says what they hold, in JSON for numpy, and enumerations are constants too. The C
compiler holds all this against the header.
"""

from __future__ import annotations

import json
import re
import sys
from pathlib import Path

import numpy as np

sys.path.insert(0, str(Path(__file__).resolve().parents[1]/"src_f90"))

import c_header  # noqa: E402

NUMBERS = {"int": "integer", "double": "double precision"}
FORMATS = {"int": "i4", "double": "f8"}
#: Functions that are over at once keep other Python threads waiting; all others let them run.
QUICK = re.compile(r"emcon_(get_(?!gaps)|add_|free|message|is_done|version|close|find_)")


def layouts(header: c_header.Header) -> dict[str, list[tuple[str, str]]]:
    """What each structure holds: names and formats of numpy, or names of structures."""
    return {name: [(part.name, "u8" if part.level else FORMATS.get(part.kind, part.kind))
                   for part in parts] for name, parts in header.structures.items()}


def dtypes(header: c_header.Header) -> dict[str, np.dtype]:
    """Structures as numpy sees them."""
    found: dict[str, np.dtype] = {}
    for name, parts in layouts(header).items():
        found[name] = np.dtype([(part, found.get(kind, kind)) for part, kind in parts], align=True)
    return found


class Argument(c_header.Argument):
    """An argument of C, and what becomes of it."""

    def __init__(self, found: c_header.Argument, header: c_header.Header) -> None:
        vars(self).update(vars(found))
        self.is_structure, self.is_number = self.kind in header.structures, self.kind in NUMBERS
        #: The first extent, where it is not fixed.
        self.extent = self.extents[0] if self.extents and (
            self.or_null or not self.extents[0].isdigit()) else ""
        is_input = self.is_in or self.in_out
        self.is_input_array = bool(self.extent) and is_input and self.is_number
        self.is_output_array = bool(self.extents) and not is_input and self.is_number
        self.before = self.after = ""
        self.passed, self.declared = self._forms(header)

    def _forms(self, header: c_header.Header) -> tuple[str, str]:
        """How C gets it, and its declaration."""
        name = self.name
        if self.level == 2:
            self.before = f"{self.ctype} *at_{name} = NULL; "
            self.after = f" {name} = (npy_intp)at_{name};"
            return f"&at_{name}", f"integer*8 intent(out) :: {name}"
        if self.kind == "char" and self.is_in:
            return name, f"character*(*) intent(in,c) :: {name}"
        if self.kind == "char":
            return (f"(char *){name}",
                    f"integer*1 dimension({self.extents[0]}),intent(out,c) :: {name}")
        if self.kind in header.opaque | set(header.pointers) | {"void"}:
            stars = "*"*self.level
            return f"({self.ctype} {stars})(npy_intp){name}", f"integer*8 intent(in,c) :: {name}"
        if self.is_structure:
            size = "*".join([str(dtypes(header)[self.kind].itemsize), *self.extents])
            way = "in" if self.is_in else "out"
            return (f"({self.ctype} *){name}",
                    f"integer*1 dimension({size}),intent({way},c) :: {name}")
        if not self.is_number:
            raise SystemExit(f"make_pyf.py: what is {self.kind}?")
        number = NUMBERS[self.kind]
        if self.level == 0:
            return name, f"{number} intent(in,c) :: {name}"
        if not self.extents:
            return f"&{name}", f"{number} intent(out) :: {name}"
        way = "in,out,copy" if self.in_out else "in" if self.is_in else "out"
        extents = [f"len_{name}", *self.extents[1:]] if self.is_input_array else self.extents
        passed = f"(len_{name} > 0 ? {name} : NULL)" if self.or_null else name
        return passed, f"{number} dimension({','.join(extents)}),intent({way},c) :: {name}"

    def may_be_left_out(self) -> None:
        """Of an output array: there is an argument no_NAME."""
        self.passed = f"(no_{self.name} ? NULL : {self.name})"
        self.declared = re.sub(r"dimension\((\w+)", rf"dimension(\1*(1-no_{self.name})",
                               self.declared)


class Function:
    """A function of C, and the block that stands for it."""

    def __init__(self, found: c_header.Function, header: c_header.Header) -> None:
        self.name = name = found.name
        self.arguments = [Argument(a, header) for a in found.arguments]
        outputs = [a for a in self.arguments if a.is_output_array]
        outputs = outputs if len(outputs) > 1 else []
        for a in outputs:
            a.may_be_left_out()
        self.names = [a.name for a in self.arguments]
        self.lines = [a.declared for a in self.arguments]
        self.call = f"{name}({', '.join(a.passed for a in self.arguments)});"
        if found.result != "void":
            kind, cast = ("integer*8", "(npy_intp)") if "*" in found.result else ("integer", "")
            self.names.insert(0, "status")
            self.lines.insert(0, f"{kind} intent(out) :: status")
            self.call = f"status = {cast}{self.call}"
        for extent in dict.fromkeys(a.extent for a in self.arguments if a.extent):
            self._count(extent)
        self._further_counts()
        for a in outputs:
            self._add(f"no_{a.name}", f"integer intent(in,c),optional :: no_{a.name} = 0")

    def _further_counts(self) -> None:
        """Further extents that are sizes of the model, n_dim: it tells them, arrays have to fit."""
        for extent in dict.fromkeys(e for a in self.arguments for e in a.extents[1:]
                                    if not e.isdigit() and e not in self.names):
            self._add(extent, f"integer intent(hide),depend(model) :: {extent} = "
                              f"size_{extent}(model)")

    def _add(self, name: str, line: str) -> None:
        self.names.append(name)
        self.lines.append(line)

    def _count(self, extent: str) -> None:
        """Where the first extent of arrays is known from, and what holds them to it.

        numpy takes an array without entries for one entry where its extent is given: each input
        array has a length of its own.
        """
        inputs = [a for a in self.arguments if a.extent == extent and a.is_input_array]
        needed = [a for a in inputs if not a.or_null]
        is_told = extent in self.names or extent.isdigit()             # C knows it
        is_known = is_told or bool(needed) or len(inputs) < sum(
            a.extent == extent for a in self.arguments)
        if needed:
            self.lines = [line for line in self.lines if not line.endswith(f":: {extent}")]
            line = (f"integer intent(hide),depend({needed[0].name}) :: {extent} = "
                    f"shape({needed[0].name},0)")
            self.names += [] if is_told else [extent]
            self.lines.append(line)
        elif is_known and not is_told:
            self._add(extent, f"integer intent(in,c) :: {extent}")
        for a in inputs:
            length, also = f"len_{a.name}", f"len_{a.name}==0||" if a.or_null else ""
            check = f",{extent}),check({also}{length}=={extent}" if is_known else ""
            self._add(length, f"integer intent(hide),depend({a.name}{check}) :: {length} = "
                              f"shape({a.name},0)")
        if not is_told:
            raise SystemExit(f"make_pyf.py: {self.name} is not told {extent}")

    def block(self) -> str:
        call = "{" + "".join(a.before for a in self.arguments) + self.call + "".join(
            a.after for a in self.arguments) + "}"
        safe = [] if QUICK.match(self.name) else ["threadsafe"]
        block = [f"subroutine {self.name}({', '.join(self.names)})", "  fortranname",
                 f"  callstatement {call}", "  callprotoargument void",
                 *(f"  {line}" for line in safe + self.lines), f"end subroutine {self.name}"]
        return "\n".join(f"    {line}" for line in block)


def main() -> None:
    path = Path(sys.argv[1])
    header = c_header.Header(path.read_text(encoding="utf-8"))
    sizes = "\n".join(f"typedef char fits_{name}[sizeof({name}) == {found.itemsize} ? 1 : -1];"
                      for name, found in dtypes(header).items())
    table = json.dumps(layouts(header)).replace('"', '\\"')
    constants = "\n".join(f'PyModule_AddIntConstant(m, "{name}", {name});'
                          for name in header.constants)
    functions = [Function(found, header) for found in header.functions]
    further = dict.fromkeys(e for f in functions for a in f.arguments for e in a.extents[1:]
                            if not e.isdigit())
    of_model = "\n".join(
        f"static int size_{e}(npy_intp model) {{emcon_sizes s; return "
        f"emcon_get_sizes((emcon_model *)model, &s) == EMCON_OK ? s.{e} : 0;}}" for e in further)
    print(f"""\
!    -*- f90 -*-
python module _core
  usercode '''
#include "{path.name}"
{sizes}
{of_model}
'''
  interface
    usercode '''
{constants}
PyModule_AddStringConstant(m, "STRUCTURES", "{table}");
'''
""" + "\n".join(f.block() for f in functions) + """
  end interface
end python module _core""")


if __name__ == "__main__":
    main()
