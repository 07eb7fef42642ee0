"""The deck of a study: its text with all that it includes, its parameters, finer meshes of it."""

from __future__ import annotations

import hashlib
import re
import warnings
from dataclasses import dataclass
from itertools import takewhile
from pathlib import Path

from ..deck_text import set_text, table
from ..mesh import Mesh, MeshError, MeshWarning, refine
from ..mesh.abaqus import _cards, _Model
from .errors import StudyError

#: Cards of the mesh, which a finer one replaces.
_MESH = {"NODE", "ELEMENT", "NSET", "ELSET"}
#: Cards whose values belong to each node of a set: more nodes would change what they mean.
_PER_NODE = {"CLOAD", "EQUATION"}
_DEEPEST = 20


@dataclass(frozen=True)
class DeckFile:
    """A deck: `text` has the included files in it."""

    path: Path
    text: str

    @property
    def name(self) -> str:
        """Base name of its results."""
        return self.path.stem

    @property
    def checksum(self) -> str:
        """Of the text, included files and all."""
        return hashlib.sha256(self.text.encode()).hexdigest()

    def parameters(self) -> dict[str, str]:
        """Values of `*PARAMETER` as they are written, by name in small letters."""
        found: dict[str, str] = {}
        inside = False
        for line in self.text.splitlines():
            text = line.strip()
            if text.startswith("*") and not text.startswith("**"):
                inside = _keyword(text) == "PARAMETER"
            elif inside and "=" in text and not text.startswith("**"):
                name, _, value = text.partition("#")[0].partition("=")
                found[name.strip().lower()] = value.strip().strip("\"'")
        return found


def read_deck(path: Path) -> DeckFile:
    """The deck in `path`; raises `StudyError` where it, or what it includes, cannot be read."""
    return DeckFile(path, "".join(line + "\n" for line in _lines(path, 0)))


def _lines(path: Path, depth: int) -> list[str]:
    if depth > _DEEPEST:
        raise StudyError(f"{path}: files are nested deeper than {_DEEPEST}")
    try:
        lines = path.read_text(encoding="utf-8-sig", errors="replace").splitlines()
    except OSError as problem:
        raise StudyError(f"cannot read {path}: {problem.strerror}") from None
    found: list[str] = []
    for line in lines:
        if line.startswith("*") and _keyword(line) == "INCLUDE":
            name = re.search(r"INPUT\s*=\s*([^,]+)", line, re.IGNORECASE)
            inner = name[1].strip().strip("\"'") if name else ""
            found += _lines(path.parent/inner, depth + 1)
        else:
            found.append(line)
    return found


def _keyword(line: str) -> str:
    return re.sub(r"\s", "", line.split(",")[0][1:]).upper()


# --- finer meshes ------------------------------------------------------------------------------

def refined_deck(deck: DeckFile, times: int, scratch: Path) -> str:
    """The text of `deck` with each element cut in four, in space in eight, `times` times; all else stays.

    scratch   file that may be written

    Raises `StudyError` where a card would no longer mean the same on the finer mesh.
    """
    scratch.write_text(deck.text, encoding="utf-8")
    model = _Model(deck.path.name)
    try:
        with warnings.catch_warnings():
            warnings.simplefilter("ignore", MeshWarning)
            for card in _cards(scratch, 0):
                model.take(card)
            mesh = model.mesh()
        coarse = {name: len(members) for name, members in mesh.node_sets.items()}
        loads = _pressed_faces(deck.text, model, mesh)
        fine = refine(mesh, times, above=max(model.node))
    except (MeshError, OSError) as problem:
        text = str(problem).replace(str(scratch), str(deck.path))
        raise StudyError(f"{deck.path}: its mesh cannot be refined: {text}") from None
    finally:
        scratch.unlink(missing_ok=True)
    for name in loads.values():
        fine.add_element_set(name, list(dict.fromkeys(fine.surfaces.pop(name)[:, 0].tolist())))
    grown = {name for name, members in fine.node_sets.items() if len(members) > coarse[name]}
    return _rewritten(deck, _mesh_text(model, mesh, fine), loads, grown)


def _pressed_faces(text: str, model: _Model, mesh: Mesh) -> dict[tuple[str, str], str]:
    """Names of surfaces for the `*DLOAD` lines, by element or set and type of load.

    Of a refined element not all parts have a face of the old one, and a label names one part.
    """
    found: dict[tuple[str, str], str] = {}
    for keyword, words in _data_lines(text):
        if keyword != "DLOAD" or len(words) < 2:
            continue
        target, kind = words[0].upper(), words[1].upper()
        face = re.fullmatch(r"P([1-6])", kind)
        if not face or (target, kind) in found:
            continue
        members = model._members("*DLOAD", words[0], model.element_set)
        name = f"{'E' if target.isdigit() else ''}{target}_{kind}_PARTS"
        mesh.add_surface(name, [(e, int(face[1])) for e in members])
        found[target, kind] = name
    return found


def _data_lines(text: str) -> list[tuple[str, list[str]]]:
    """Keyword and words of each data line."""
    found, keyword = [], ""
    for line in text.splitlines():
        stripped = line.strip()
        if not stripped or stripped.startswith("**"):
            continue
        if stripped.startswith("*"):
            keyword = _keyword(stripped)
        else:
            found.append((keyword, [word.strip() for word in stripped.split(",")]))
    return found


def _mesh_text(model: _Model, mesh: Mesh, fine: Mesh) -> str:
    """Cards of the mesh; nodes of no element, of rigid bodies, and their sets as they were."""
    known = set(mesh.node_labels.tolist())
    text = fine.text()
    for label, x in model.node.items():
        if label not in known:
            text += f"*NODE\n{label}, {', '.join(map(repr, x))}\n"
    for name, members in model.node_set.items():
        loose = [label for label in dict.fromkeys(members) if label not in known]
        if loose:
            text += set_text("NSET", name, loose)
    return text


def _rewritten(deck: DeckFile, mesh: str, loads: dict[tuple[str, str], str],
               grown: set[str]) -> str:
    """The cards of the deck with those of the mesh replaced, where the first of them stood."""
    kept: list[str] = []
    keyword, drops, is_written = "", False, False
    for number, line in enumerate(deck.text.splitlines(), 1):
        text = line.strip()
        if text.startswith("*") and not text.startswith("**"):
            keyword = _keyword(text)
            drops = keyword in _MESH or (keyword == "SURFACE" and _is_of_faces(text))
            if drops and not is_written:
                kept.append(mesh.rstrip("\n"))
                is_written = True
        elif not drops and text and not text.startswith("**"):
            words = [word.strip() for word in text.split(",")]
            _check_line(deck, number, keyword, words, grown)
            name = loads.get((words[0].upper(), words[1].upper() if len(words) > 1 else ""))
            if keyword == "DLOAD" and name:
                line = ", ".join([name, *words[1:]])
        if not drops:
            kept.append(line)
    return "\n".join(kept) + "\n"


def _is_of_faces(line: str) -> bool:
    kind = re.search(r"TYPE\s*=\s*(\w+)", line, re.IGNORECASE)
    return not kind or kind[1].upper() == "ELEMENT"


def _check_line(deck: DeckFile, number: int, keyword: str, words: list[str],
                grown: set[str]) -> None:
    where = f"{deck.path}: its mesh cannot be refined: *{keyword}"
    if keyword in _PER_NODE:
        named = next((word for word in words if word.upper() in grown), None)
        if named:
            raise StudyError(f"{where}: the values on the set {named} are those of each node, and "
                             "a finer mesh has more; name single nodes, or load by *DLOAD")
    if keyword == "DLOAD" and words[0].isdigit() and not re.fullmatch(r"[pP][1-6]", words[1]):
        raise StudyError(f"{where}: element {words[0]} is cut in parts; name an element set")
    if keyword == "INITIALCONDITIONS" and words[0].isdigit():
        raise StudyError(f"{where}: node {words[0]} is named by its label (line {number} of the "
                         "deck with its included files), and new nodes have none; name a set")


def times_of(factor: str) -> int:
    """How often a mesh is refined for a factor 1, 2, 4, ... of the number of edges."""
    value = int(factor) if factor.isdigit() else 0
    times = value.bit_length() - 1
    if value < 1 or value != 2**times:
        raise StudyError(f"mesh={factor}: a mesh is refined by cutting edges in half: 1, 2, 4, ...")
    return times


def heading(text: str) -> str:
    """The first line of `*HEADING`, or nothing."""
    lines = iter(text.splitlines())
    for line in lines:
        if line.startswith("*") and not line.startswith("**") and _keyword(line) == "HEADING":
            return next(takewhile(lambda more: not more.startswith("*"), lines), "").strip()
    return ""
