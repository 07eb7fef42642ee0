"""Write the C functions in Fortran, from emcon.h and the procedures that they stand for.

    python make_c.py HEADER FOLDER SOURCE...

FOLDER gets emcon_c_types.f90, the structures and kinds of functions of emcon.h, and emcon_c.f90:
for each function one that is `bind(c)`, turns what C hands over into Fortran, calls the procedure,
and turns back. `emcon_find_load` stands for `model_find_load`, `stepper_find_load` or
`query_find_load`, whichever SOURCE has, `emcon_get_time` for `model_time`; NAMES are the others.
Arguments are matched by name, and turned by what both sides declare them as: flags and logicals,
numbers from 0 and from 1 (COUNTED), arrays by rows and by columns, matrices, texts. Counts are held
against the model where one of their arrays is given. What fits no rule is BY_HAND, in
emcon_c_by_hand.f90 and emcon_status.c.
"""

from __future__ import annotations

import re
import sys
from dataclasses import dataclass
from pathlib import Path

from c_header import Argument, Function, Header

#: Functions whose procedure has another name.
NAMES = {"evaluate_contact": "query_contact", "follow": "query_follow_links",
         "gather": "query_gather_links", "restore_snapshot": "stepper_restore",
         "resume": "model_load", "take_snapshot": "stepper_snapshot"}
BY_HAND = {"version", "close", "message", "is_done", "run", "free_snapshot", "null_space",
           "status_text", "get_field"}
#: What can be called before the model is built.
EARLY = re.compile(r"give_|add_|hold$|set_contact$|build$|resume$|get_(sizes|labels|positions)$"
                   r"|find_nodes$")
#: Numbers that count from 0 in C, and from 1 in Fortran.
COUNTED = set("i load surface slave master tie node id redundant edge unknown pair body".split())
#: Owners: the type of the dummy, and where a model has it.
OWNERS = {"model_t": "self", "stepper_t": "self%stepper", "query_t": "self%query"}
NUMBERS = {"int": "integer(c_int)", "double": "real(c_double)"}
KINDS = {"int": ("integer", "logical"), "double": ("real",)}


@dataclass
class Dummy:
    """A dummy argument of a Fortran procedure."""

    name: str
    kind: str          # integer, real, logical, character, or the name of a derived type
    rank: int
    intent: str        # in, out or inout
    is_optional: bool
    is_allocatable: bool


@dataclass
class Procedure:
    """A public procedure of the library."""

    module: str
    name: str
    dummies: list[Dummy]


def procedures(paths: list[Path]) -> dict[str, Procedure]:
    """The subroutines of the sources that C functions can stand for."""
    found = {}
    for path in paths:
        text = re.sub(r"!.*", "", path.read_text(encoding="utf-8"))
        text = re.sub(r"&\s*\n\s*&?", "", text)
        for name, names, body in re.findall(
                r"^ *(?:pure )?subroutine (\w+)\(([^)]*)\)(.*?)^ *end subroutine", text,
                re.MULTILINE | re.DOTALL):
            if re.match(r"(model|stepper|query)_", name):
                found[name] = Procedure(path.stem, name, dummies(names, body))
    return found


def dummies(names: str, body: str) -> list[Dummy]:
    """The dummy arguments `names`, as `body` declares them."""
    declared = {}
    for kind, attributes, rest in re.findall(
            r"^ *((?:integer|real|logical|character|type|class)\b(?:\([^)]*\))?)([^:\n]*)::(.*)",
            body, re.MULTILINE):
        derived = re.match(r"(?:type|class)\((\w+)\)", kind)
        for name, shape in re.findall(r"(\w+)\s*(\([^)]*\))?", rest):
            intent = re.search(r"intent\((\w+)\)", attributes)
            declared[name] = Dummy(name, derived[1] if derived else kind.split("(")[0],
                                   shape.count(":"), intent[1] if intent else "",
                                   "optional" in attributes, "allocatable" in attributes)
    return [declared[name.strip()] for name in names.split(",")]


class Wrapper:
    """A `bind(c)` function around a procedure."""

    def __init__(self, function: Function, procedure: Procedure, header: Header,
                 slots: dict[str, int]) -> None:
        self.function, self.procedure = function, procedure
        self.header, self.slots = header, slots
        self.short = function.name.removeprefix("emcon_")
        self.of_c = {a.name: a for a in function.arguments}
        self.sizes = {a.name for a in header.structures["emcon_sizes"]}
        self.locals: list[str] = ["type(error_t), allocatable :: error"]
        self.before: list[str] = []
        self.after: list[str] = []
        self.always: list[str] = []       # done after a failure, too
        first = next((a for a in function.arguments if a.kind == "emcon_model"), None)
        self.has_model, self.makes_model = bool(first), bool(first) and first.level == 2
        self.uses = {procedure.name}
        self.actual = [f"{d.name}={self.hand_over(d)}" for d in procedure.dummies]

    def fail(self, what: str) -> None:
        raise SystemExit(f"make_c.py: {self.function.name}: {what}")

    def hand_over(self, dummy: Dummy) -> str:
        """What the procedure gets for a dummy; notes what has to be done before and after."""
        if dummy.kind in OWNERS:
            return OWNERS[dummy.kind]
        if dummy.kind == "error_t":
            return "error"
        a = self.of_c.pop(dummy.name, None)
        if a is None:
            self.fail(f"emcon.h has no argument {dummy.name}")
        if dummy.intent != self.intent(a):
            self.fail(f"{a.name} is intent({self.intent(a)}) in C, not intent({dummy.intent})")
        if dummy.kind not in KINDS.get(a.kind, (dummy.kind,)):
            self.fail(f"{a.name} is {a.kind} in C, but {dummy.kind} in Fortran")
        if a.level == 0:
            return self.scalar(a, dummy)
        if a.kind == "char":
            return self.text(a, dummy)
        if a.kind in ("void", *self.header.pointers):
            return a.name
        if a.kind in self.header.opaque:
            return self.object(a)
        if a.kind in self.header.structures:
            return self.structure(a)
        return self.numbers(a, dummy)

    def intent(self, a: Argument) -> str:
        """What the header says of who writes an argument."""
        if a.in_out:
            return "inout"
        is_address = a.kind in ("void", *self.header.pointers)
        return "in" if a.level == 0 or is_address or (a.is_in and a.level == 1) else "out"

    def scalar(self, a: Argument, dummy: Dummy) -> str:
        if a.kind in self.header.pointers:
            return a.name
        if dummy.kind == "logical":
            return f"{a.name} /= 0"
        if a.kind == "double":
            return f"real({a.name}, wp)"
        return f"from_1({a.name})" if a.name in COUNTED else f"int({a.name})"

    def text(self, a: Argument, dummy: Dummy) -> str:
        """A text in, one that the model keeps, or one into the room that C has for it."""
        if a.is_in and a.level == 1:
            if not a.or_null:
                self.before.append(f'call check_given("{a.name}", {a.name}, error)')
            return f"f_text({a.name})"
        self.locals.append(f"character(len=:), allocatable :: f_{a.name}")
        if a.level == 2:
            slot = self.slot("text")
            self.after += [f"self%text({slot})%c = c_string(f_{a.name})",
                           f"call put_address(c_loc(self%text({slot})%c), {a.name})"]
        else:
            self.after.append(f"call put_text(f_{a.name}, {a.extents[0]}, {a.name}, error)")
        return f"f_{a.name}"

    def slot(self, kind: str) -> int:
        """The next place for what a model keeps for C."""
        self.slots[kind] = self.slots.get(kind, 0) + 1
        return self.slots[kind]

    def object(self, a: Argument) -> str:
        """What C holds by its address."""
        kind = a.kind.removeprefix("emcon_") + "_t"
        self.uses.add(kind)
        self.locals.append(f"type({kind}), pointer :: f_{a.name}")
        self.before.append(f'call check_given("{a.name}", {a.name}, error)')
        if a.level == 2:
            self.before.append(f"if (.not. allocated(error)) allocate(f_{a.name})")
            self.after.append(f"call put_address(c_loc(f_{a.name}), {a.name})")
            self.always.append(f"if (allocated(error)) call put_address(c_null_ptr, {a.name})")
        else:
            self.before += ["if (.not. allocated(error)) "
                            f"call c_f_pointer({a.name}, f_{a.name})"]
        return f"f_{a.name}"

    def structure(self, a: Argument) -> str:
        """A structure, an array of them, or a matrix."""
        kind = a.kind.removeprefix("emcon_") + "_c"
        if a.kind == "emcon_csr" and a.is_in:
            self.locals.append(f"type(csr_t) :: f_{a.name}")
            self.before.append(f'call take_matrix("{a.name}", {a.name}, f_{a.name}, error)')
            return f"f_{a.name}"
        if a.kind == "emcon_csr":
            place = f"self%matrix({self.slot('matrix')})"
            self.always.append(f"call put_matrix({place}, {a.name})")
            return place
        if a.kind == "emcon_constraint_report":
            self.always.append(f"call put_report(self, error, {a.name})")
            return "self%report"
        self.locals.append(f"type({kind}), pointer :: c_{a.name}{shape(len(a.extents))}")
        if not (a.is_in or a.extents):     # filled in its place, whose padding is the caller's
            self.locals.append(f"type({kind}), target :: f_{a.name}")
            self.before += [f"c_{a.name} => f_{a.name}",
                            f"if (c_associated({a.name})) call c_f_pointer({a.name}, c_{a.name})"]
            return f"c_{a.name}"
        if a.is_in:
            self.before += [f"c_{a.name} => null()", *self.given(a, [
                f"call c_f_pointer({a.name}, c_{a.name})"], [])]
            return f"c_{a.name}"
        self.check_count(a)
        self.locals.append(f"type({kind}), allocatable :: f_{a.name}(:)")
        self.after += self.put(a, f"f_{a.name}", 1)
        return f"f_{a.name}"

    def numbers(self, a: Argument, dummy: Dummy) -> str:
        """Numbers and flags, one or an array of them."""
        of_c, rank = NUMBERS[a.kind], len(a.extents) if dummy.rank else 0
        if rank != dummy.rank:
            self.fail(f"{a.name} has {len(a.extents)} extents, but its dummy has {dummy.rank}")
        if rank and not (a.is_in or a.in_out or dummy.is_allocatable):
            self.fail(f"{a.name} is an output that is not allocatable in Fortran")
        if dummy.is_optional and not a.or_null:
            self.fail(f"{a.name} may be left out in Fortran, but not NULL")
        self.locals.append(f"{of_c}, pointer :: c_{a.name}{shape(rank)}")
        of_f = {"real": "real(wp)"}.get(dummy.kind, dummy.kind)
        is_input = a.is_in or a.in_out
        allocatable = ", allocatable" if rank or is_input else ""
        self.locals.append(f"{of_f}{allocatable} :: f_{a.name}{shape(rank)}")
        self.check_count(a)
        if is_input:
            extents = ", ".join(self.extent(e) for e in reversed(a.extents))
            read = f"c_f_pointer({a.name}, c_{a.name}" + (f", [{extents}])" if rank else ")")
            self.before += self.given(a, [f"call {read}", f"allocate(f_{a.name}, "
                                          f"source={self.to_f(a, dummy)})"],
                                      [f"allocate(f_{a.name}({extents}))"])
        if not a.is_in:
            self.after += self.put(a, self.to_c(a, dummy), rank)
        return f"f_{a.name}"

    def extent(self, e: str) -> str:
        """An extent in Fortran: a number, one of the model's, or an argument."""
        if e in self.sizes and e not in {a.name for a in self.function.arguments}:
            return f"sizes%{e}"
        return e if e.isdigit() else f"max(0, {e})"

    def to_f(self, a: Argument, dummy: Dummy) -> str:
        if dummy.kind == "logical":
            return f"c_{a.name} /= 0"
        if dummy.kind == "real":
            return f"real(c_{a.name}, wp)"
        return f"from_1(c_{a.name})" if a.name in COUNTED else f"int(c_{a.name})"

    def to_c(self, a: Argument, dummy: Dummy) -> str:
        if dummy.kind == "logical":
            return f"merge(1_c_int, 0_c_int, f_{a.name})"
        if dummy.kind == "real":
            return f"real(f_{a.name}, c_double)"
        return f"int(f_{a.name}{' - 1' if a.name in COUNTED else ''}, c_int)"

    def check_count(self, a: Argument) -> None:
        """Hold the count of an array against the model, or against what can be counted."""
        count = a.extents[0] if a.extents else "1"
        if count.isdigit():
            return
        if count in self.sizes and not self.makes_model:
            self.before.append(f'call check_count("{count}", {count}, sizes%{count}, {a.name}, '
                               "error)")
        else:
            self.before.append(f'call check_free_count("{count}", {count}, error)')

    def given(self, a: Argument, lines: list[str], otherwise: list[str]) -> list[str]:
        """Lines for an input that is not NULL; one without entries may be."""
        count = a.extents[0] if a.extents else "1"
        check = []
        if not a.or_null and count.isdigit():
            check = [f'call check_given("{a.name}", {a.name}, error)']
        elif not a.or_null:
            check = [f'if ({count} > 0) call check_given("{a.name}", {a.name}, error)']
        test = f"if (c_associated({a.name}) .and. .not. allocated(error)) then"
        if a.or_null or count.isdigit():
            return [*check, test, *indent(lines), "end if"]
        return [*check, test, *indent(lines), "else if (.not. allocated(error)) then",
                *indent(otherwise), "end if"]

    def put(self, a: Argument, value: str, rank: int) -> list[str]:
        target = f"shape(f_{a.name})"
        pointer = f"c_f_pointer({a.name}, c_{a.name}" + (f", {target})" if rank else ")")
        return [f"if (c_associated({a.name})) then", f"   call {pointer}",
                f"   c_{a.name} = {value}", "end if"]

    def text_of(self) -> list[str]:
        """The function."""
        names = ", ".join(map(name_of, self.function.arguments))
        lines = [f"integer(c_int) function {self.function.name}({names}) result(status) bind(c)"]
        body = [declaration(a, self.header) for a in self.function.arguments]
        needs_sizes = any("sizes%" in line for line in self.before)
        if self.has_model:
            body.append("type(model_t), pointer :: self")
        if needs_sizes:
            body.append("type(sizes_c) :: sizes")
        body += [*self.locals, ""]
        if self.makes_model:
            body += ["call new_handle(handle, self, status)"]
        elif self.has_model:
            find = "find_read" if EARLY.match(self.short) else "find_built"
            body += [f"call {find}(handle, self, status)"]
        if self.has_model:
            body += ["if (status /= err_none) return"]
        if needs_sizes:
            body += ["call model_sizes(self, sizes)"]
        body += [*self.before, "if (.not. allocated(error)) then",
                 f"   call {self.procedure.name}({', '.join(self.actual)})", "end if"]
        if self.after:
            body += ["if (.not. allocated(error)) then", *indent(self.after), "end if"]
        body += self.always
        body += ["call handle_pass(self, error, status)" if self.has_model else
                 "status = code_of(error)"]
        return [*lines, *indent(body), f"end function {self.function.name}"]


def shape(rank: int) -> str:
    return "(" + ", ".join(":"*rank) + ")" if rank else ""


def indent(lines: list[str]) -> list[str]:
    return ["   " + line if line else line for line in lines]


def folded(line: str) -> str:
    """A line of at most 100 columns, or several."""
    margin = re.match(" *", line)[0]
    out = []
    while len(line) > 100:
        cut = line.rfind(", ", 0, 97) + 2
        out.append(line[:cut].rstrip() + " &")
        line = margin + "   " + line[cut:]
    return "\n".join([*out, line])


def declaration(a: Argument, header: Header) -> str:
    """A dummy of a `bind(c)` function."""
    if a.level == 0 and a.kind in NUMBERS:
        return f"{NUMBERS[a.kind]}, value :: {a.name}"
    kind = "c_funptr" if a.kind in header.pointers else "c_ptr"
    return f"type({kind}), value :: {name_of(a)}"


def name_of(a: Argument) -> str:
    """The name of a dummy of a `bind(c)` function."""
    return "handle" if a.kind == "emcon_model" else a.name


def types(header: Header) -> list[str]:
    """The structures, and interfaces of the functions that C hands over."""
    lines = []
    for name, parts in header.structures.items():
        lines += ["", f"type, bind(c) :: {name.removeprefix('emcon_')}_c"]
        for part in parts:
            if part.level:
                lines.append(f"   type(c_ptr) :: {part.name} = c_null_ptr")
            elif part.kind in NUMBERS:
                zero = "0" if part.kind == "int" else "0.0_c_double"
                lines.append(f"   {NUMBERS[part.kind]} :: {part.name} = {zero}")
            else:
                lines.append(f"   type({part.kind.removeprefix('emcon_')}_c) :: {part.name}")
        lines.append(f"end type {name.removeprefix('emcon_')}_c")
    lines += ["", "abstract interface"]
    for name, function in header.pointers.items():
        short = name.removeprefix("emcon_") + "_c"
        names = ", ".join(a.name for a in function.arguments)
        word, tail = ("subroutine", "") if function.result == "void" else ("function",
                                                                           " result(answer)")
        block = [f"{word} {short}({names}){tail} bind(c)",
                 "   import :: c_double, c_int, c_ptr", "   implicit none",
                 *indent([declaration(a, header) for a in function.arguments])]
        if tail:
            block.append("   integer(c_int) :: answer")
        lines += indent([*block, f"end {word} {short}"])
    return [*lines, "end interface"]


def module(name: str, about: str, head: list[str], body: list[str]) -> str:
    lines = [f"!> {about} Made by make_c.py from emcon.h.", f"module {name}", *indent(head), *body,
             f"end module {name}", ""]
    return "\n".join(folded(line) for line in lines)


def functions(header: Header, known: dict[str, Procedure]) -> tuple[list[str], list[str]]:
    """The head of the module, and the functions."""
    slots: dict[str, int] = {}
    wrappers = []
    for function in header.functions:
        short = function.name.removeprefix("emcon_")
        if short in BY_HAND:
            continue
        names = [NAMES[short]] if short in NAMES else [
            f"{room}_{form}" for form in dict.fromkeys((short, short.removeprefix("get_")))
            for room in ("model", "stepper", "query")]
        name = next((n for n in names if n in known), None)
        if not name:
            raise SystemExit(f"make_c.py: none of {', '.join(names)} stands for {function.name}")
        wrapper = Wrapper(function, known[name], header, slots)
        left = [a for a in wrapper.of_c.values() if a.kind != "emcon_model"]
        counts = {e for a in function.arguments for e in a.extents}
        if any(a.name not in counts for a in left):
            raise SystemExit(f"make_c.py: {name} has no dummy for {[a.name for a in left]}")
        wrappers.append(wrapper)
    uses: dict[str, set[str]] = {}
    for wrapper in wrappers:
        uses.setdefault(wrapper.procedure.module, set()).update(wrapper.uses)
    head = [f"use {m}, only : {', '.join(sorted(n))}" for m, n in sorted(uses.items())
            if m != "emcon_model"]
    names = [f"public :: {wrapper.function.name}" for wrapper in wrappers]
    body = [line for wrapper in wrappers for line in ["", *indent(wrapper.text_of())]]
    return [*head, "implicit none", "private", *names, ""], body


def main() -> None:
    folder = Path(sys.argv[2])
    header = Header(Path(sys.argv[1]).read_text(encoding="utf-8"))
    kinds = "c_double, c_funptr, c_int, c_null_ptr, c_ptr"
    put(folder/"emcon_c_types.f90", module(
        "emcon_c_types", "The structures of emcon.h, and interfaces of what C hands over.",
        [f"use, intrinsic :: iso_c_binding, only : {kinds}", "implicit none", "public",
         f"private :: {kinds}"],
        indent(types(header))))
    head, body = functions(header, procedures([Path(p) for p in sys.argv[3:]]))
    put(folder/"emcon_c.f90", "! build: holder\n" + module(
        "emcon_c", "The C functions; what each of them does is said in emcon.h.",
        ["use, intrinsic :: iso_c_binding", "use emcon_c_border", "use emcon_c_types",
         "use emcon_csr, only : csr_t", "use emcon_errors, only : err_none, error_t",
         "use emcon_kinds, only : wp", "use emcon_model", *head], ["contains", *body, ""]))


def put(path: Path, text: str) -> None:
    """Write a file, unless that is what it holds: its time tells whether it has to be compiled."""
    if not path.exists() or path.read_text(encoding="utf-8") != text:
        path.write_text(text, encoding="utf-8")


if __name__ == "__main__":
    main()
