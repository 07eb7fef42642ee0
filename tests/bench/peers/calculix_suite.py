"""The test decks of CalculiX (Debian package calculix-ccx-test): where they are, what they leave."""

import gzip
import pathlib
import re

import numpy as np
from timing import usage

FOLDER = pathlib.Path("/usr/share/doc/calculix-ccx-test/examples/test")
#: Seconds that a deck may take.
MOST = 300
#: Digits that files have behind the first: .dat 1PE14.6, .frd 1PE12.5.
DAT, FRD = 5e-7, 5e-6

#: Cards and elements of what is no mechanics of solids.
FOREIGN = re.compile(
    r"\*(?:HEATTRANSFER|COUPLEDTEMP|UNCOUPLEDTEMP|FLUID|CFD|RADIATE|ELECTRO|MAGNET|GREEN|"
    r"SENSITIVITY|DESIGNVAR|OBJECTIVE|NETWORKMPC|COMPRESSIBLE|FILM)|TYPE=(?:D|F3D\w+|DCOUP\w*)(?:,|$)")


def decks(folder):
    """Paths of all decks by name, unpacked or not."""
    found = {path.name.removesuffix(".gz").removesuffix(".inp"): path
             for path in sorted(folder.iterdir()) if re.search(r"\.inp(\.gz)?$", path.name)}
    return dict(sorted(found.items()))


def text_of(path):
    data = path.read_bytes()
    return (gzip.decompress(data) if path.suffix == ".gz" else data).decode("latin-1")


def cards_of(text):
    """Keyword lines in capitals, without blanks."""
    return [re.sub(r"\s", "", line).upper() for line in text.splitlines()
            if line.startswith("*") and not line.startswith("**")]


def is_mechanical(text):
    return not any(FOREIGN.search(card) for card in cards_of(text))


def element_types(text):
    """Types of the elements, in the order of the deck."""
    found = (re.search(r"TYPE=(\w+)", card) for card in cards_of(text)
             if card.startswith("*ELEMENT,"))
    return list(dict.fromkeys(match[1] for match in found if match))


def node_labels(text):
    """Labels of the nodes, each where it is first told, in the order of the deck."""
    labels, is_node = {}, False
    for line in text.splitlines():
        if line.startswith("*"):
            is_node = re.match(r"\*node\s*(,|$)", line, re.IGNORECASE) or (
                is_node and line.startswith("**"))
        elif is_node and line.strip():
            labels[int(line.split(",")[0])] = None
    return list(labels)


def run(program, deck):
    """Displacements that a run of `deck` in its folder prints: {time: {node: (x, y, z)}}, and half
    a unit of the last digit, relative to the value; None where it fails or prints none."""
    done = usage(["/usr/bin/timeout", MOST, program, "-i", deck.stem], deck.parent)
    dat, frd = deck.with_suffix(".dat"), deck.with_suffix(".frd")
    if done.code != 0:
        return None
    for path, read, digit in ((dat, read_dat, DAT), (frd, read_frd, FRD)):
        told = read(path.read_text("latin-1")) if path.exists() else {}
        if told:
            return told, digit
    return None


def read_dat(text):
    """Blocks of U in NAME.dat."""
    told = {}
    title = re.compile(r"^ displacements \(vx,vy,vz\) for set \S+ and time +(\S+)\n\n"
                       r"((?: +\d+(?: +[-+.\dEe]+){3}\n)+)", re.MULTILINE)
    for time, rows in title.findall(text):
        block = told.setdefault(float(time), {})
        for row in rows.splitlines():
            node, *u = row.split()
            block[int(node)] = np.array(u, float)
    return told


def read_frd(text):
    """Blocks of DISP in NAME.frd: a line of the time, then nodes in columns of twelve."""
    told, time, block = {}, None, None
    for line in text.splitlines():
        if line.startswith("  100C"):
            time = float(line[12:24])
        elif line.startswith(" -4"):
            block = told.setdefault(time, {}) if line[5:9] == "DISP" else None
        elif line.startswith(" -3"):
            block = None
        elif line.startswith(" -1") and block is not None:
            block[int(line[3:13])] = np.array([line[13 + 12*k:25 + 12*k] for k in range(3)], float)
    return told
