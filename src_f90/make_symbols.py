"""Write which symbols the shared library shows: the functions of emcon.h, and the modules.

    python make_symbols.py HEADER > SCRIPT_OF_THE_LINKER

Helpers in C, and whatever a static library brings along, stay inside.
"""

from __future__ import annotations

import sys
from pathlib import Path

from c_header import Header


def main() -> None:
    header = Header(Path(sys.argv[1]).read_text(encoding="utf-8"))
    names = [function.name for function in header.functions]
    names.append("__emcon_*")
    print("{\n  global:\n" + "".join(f"    {name};\n" for name in names) + "  local: *;\n};")


if __name__ == "__main__":
    main()
