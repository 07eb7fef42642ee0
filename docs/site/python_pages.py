"""The reference of Python, read from the docstrings of the package; nothing is imported."""

from __future__ import annotations

import ast
from pathlib import Path

from source_text import directive, markdown

ROOT = Path(__file__).resolve().parents[2]
PACKAGE = ROOT/"pywrap"/"emcon"

#: Chapters: title, what it is for, and modules with the names that are
#: shown; of a module without names all that is public.
CHAPTERS = (
    ("Models and steppers", "Scenes by calls or from decks, and their analysis.",
     {"model": ["Model"], "steps": ["Step"], "stepper": [], "given": ["Outside"],
      "derivatives": ["check_derivatives"], "errors": []}),
    ("Results", "What a run has written. No compiled library is needed.",
     {"results": [], "fields": [], "series": [], "comparison": [], "plotting": ["plot"],
      "animation": ["animate"], "export": ["export"]}),
    ("Meshes", "`emcon.mesh`", {"mesh": []}),
    ("Studies", "`emcon.study`", {"study": []}),
    ("Contact and ties for a host", "`emcon.interface`", {"interface": []}),
    ("Kernels and options", "`emcon.kernels`, `emcon.options`", {"kernels": [], "options": []}),
    ("Files of the package", "Where programs that embed the library find it.", {"__init__": []}),
)
#: Modules whose own docstring is shown.
WITH_TEXT = {"mesh", "study", "interface", "kernels", "options"}


def parse(path: Path) -> ast.Module:
    return ast.parse(path.read_text(encoding="utf-8"))


def classes() -> dict[str, ast.ClassDef]:
    """All classes of the package by name."""
    return {node.name: node for path in sorted(PACKAGE.rglob("*.py")) for node in parse(path).body
            if isinstance(node, ast.ClassDef)}


CLASSES = classes()
Function = ast.FunctionDef | ast.AsyncFunctionDef


def signature(node: Function, is_method: bool) -> str:
    arguments = ast.parse(ast.unparse(node)).body[0].args  # type: ignore[attr-defined]
    if is_method and not any(name in ("staticmethod",) for name in decorators(node)):
        first = arguments.posonlyargs or arguments.args
        del first[0]
    result = f" -> {ast.unparse(node.returns)}" if node.returns and node.name != "__init__" else ""
    return f"({ast.unparse(arguments)}){result}"


def decorators(node: Function | ast.ClassDef) -> list[str]:
    return [ast.unparse(item).split("(")[0].split(".")[-1] for item in node.decorator_list]


def members(node: ast.ClassDef) -> dict[str, Function]:
    """Public functions of a class, of its bases of the package too."""
    found: dict[str, Function] = {}
    for item in node.body:
        if isinstance(item, Function) and not item.name.startswith("_"):
            found.setdefault(item.name, item)
    for base in node.bases:
        other = CLASSES.get(ast.unparse(base).split("[")[0].split(".")[-1])
        if other is not None:
            for name, function in members(other).items():
                found.setdefault(name, function)
    return found


def attributes(node: ast.ClassDef) -> str:
    """Values of a dataclass."""
    rows = [f"- `{item.target.id}`: `{ast.unparse(item.annotation)}`" for item in node.body
            if isinstance(item, ast.AnnAssign) and isinstance(item.target, ast.Name)
            and not item.target.id.startswith("_")]
    return "\n".join(rows) if "dataclass" in decorators(node) else ""


def show_class(node: ast.ClassDef) -> str:
    init = next((item for item in node.body if isinstance(item, Function)
                 and item.name == "__init__"), None)
    parts = [markdown(ast.get_docstring(node) or ""), attributes(node)]
    if init is not None and (text := ast.get_docstring(init)):
        parts.append(markdown(text))
    for name, item in members(node).items():
        text = markdown(ast.get_docstring(item) or "")
        kinds = decorators(item)
        if "setter" in kinds or not text:
            continue
        if {"property", "cached_property"} & set(kinds):
            kind = f" : {ast.unparse(item.returns)}" if item.returns else ""
            parts.append(directive("py:attribute", f"{name}{kind}" if not kind else name,
                                   (f":type: {ast.unparse(item.returns)}\n\n" if item.returns
                                    else "") + text, 4))
        else:
            kind = {"classmethod": "py:classmethod", "staticmethod": "py:staticmethod"}
            what = next((kind[name] for name in kinds if name in kind), "py:method")
            parts.append(directive(what, name + signature(item, True), text, 4))
    head = node.name
    if init is not None and "dataclass" not in decorators(node):
        head += signature(init, True)
    return directive("py:class", head, "\n\n".join(part for part in parts if part), 5)


def public(tree: ast.Module) -> list[str]:
    """Names that a module gives away: `__all__`, or classes and functions without underscore."""
    for item in tree.body:
        if isinstance(item, ast.Assign) and ast.unparse(item.targets[0]) == "__all__":
            return list(ast.literal_eval(item.value))
    return [item.name for item in tree.body if isinstance(item, Function | ast.ClassDef)
            and not item.name.startswith("_")]


def module_path(name: str) -> Path:
    path = PACKAGE/name
    return path/"__init__.py" if path.is_dir() else path.with_suffix(".py")


def defined(path: Path, name: str) -> ast.AST | None:
    """Where a name is defined: in the module, or in what it imports it from."""
    tree = parse(path)
    for item in tree.body:
        if isinstance(item, Function | ast.ClassDef) and item.name == name:
            return item
    for item in ast.walk(tree):
        if isinstance(item, ast.ImportFrom) and item.level and item.module and any(
                alias.name == name for alias in item.names):
            base = path.parents[item.level - 1]/item.module.replace(".", "/")
            other = base/"__init__.py" if base.is_dir() else base.with_suffix(".py")
            if other.is_file() and other != path:
                return defined(other, name)
    return None


def show(path: Path, name: str) -> str:
    """What the page has of a name; nothing where it has no text."""
    node = defined(path, name)
    if isinstance(node, ast.ClassDef):
        return show_class(node)
    if isinstance(node, Function) and (text := ast.get_docstring(node)):
        return directive("py:function", name + signature(node, False), markdown(text), 4)
    return ""


def page() -> str:
    """The reference of the package."""
    made = ["# Reference of Python", "Examples of all of it: [EMCON from Python](python.md). Shapes "
            "stand in brackets, units in square ones, those of the deck: length \\[L\\], mass "
            "\\[M\\], time \\[T\\]. Names of the first two chapters are those of `emcon` itself."]
    shown: set[str] = set()
    for title, text, modules in CHAPTERS:
        made += [f"## {title}", text]
        for module, names in modules.items():
            path = module_path(module)
            made.append(directive("py:module", f"emcon.{module}".removesuffix(".__init__"), "", 3))
            if module in WITH_TEXT:
                made.append(markdown(ast.get_docstring(parse(path)) or ""))
            for name in names or public(parse(path)):
                if name not in shown:
                    shown.add(name)
                    made.append(show(path, name))
    return "\n\n".join(part for part in made if part) + "\n"
