"""Text of sources as Markdown."""

from __future__ import annotations

import re
from collections.abc import Iterator


def escape(text: str) -> str:
    """Plain text as Markdown: what is in back quotes stays code, signs are signs."""
    parts = re.split(r"(``[^`]+``|`[^`\n]+`)", text)
    return "".join(part if k % 2 else re.sub(r"([*_<>\[\]$|\\#])", r"\\\1", part)
                   for k, part in enumerate(parts))


def paragraphs(text: str) -> Iterator[list[str]]:
    """Lines between empty lines."""
    for part in re.split(r"\n\s*\n", text.strip("\n")):
        yield part.rstrip().split("\n")


ARGUMENT = re.compile(r"((?:\*{0,2}\w+(?:, )?)+)\s{2,}(\S.*)")


def markdown(docstring: str) -> str:
    """A docstring of the house: paragraphs, indented code, lines `name   what it is`."""
    made = []
    for lines in paragraphs(docstring):
        if all(line.startswith("    ") for line in lines):
            body = "\n".join(line[4:] for line in lines)
            if made and made[-1].startswith("```"):
                made[-1] = made[-1].removesuffix("```") + f"\n{body}\n```"
            else:
                made.append(f"```\n{body}\n```")
        elif ARGUMENT.fullmatch(lines[0]):
            rows: list[list[str]] = []
            for line in lines:
                if found := ARGUMENT.fullmatch(line):
                    rows.append([found[1], found[2]])
                elif rows:
                    rows[-1][1] += " " + line.strip()
            made.append("\n".join(f"- `{name}`: {escape(what)}" for name, what in rows))
        else:
            made.append(escape("\n".join(line.strip() for line in lines)))
    return "\n\n".join(made)


def directive(kind: str, head: str, body: str, depth: int) -> str:
    """A directive of Sphinx; `depth` back quotes hold those with fewer."""
    fence = "`"*depth
    return f"{fence}{{{kind}}} {head}\n\n{body}\n{fence}\n"
