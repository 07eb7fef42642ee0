"""The verdicts of drawn scenes, beside what is right: a table of good, bad and stopped runs.

    .venv/bin/python tests/soak/scene_table.py [--seeds 1 500] [--folder build/soak] [--jobs 1]

Each seed is a scene of `drawn_scenes.py`, judged by `field_check.py`. What is done is kept in
FOLDER/results.jsonl, so that a table that was interrupted goes on; `--again` begins anew. The exit
code is 1 where a run is wrong and called good, unless a warning tells of it: directions of forces are
off in steps in which bodies pass each other's corners while contact holds them far apart.
"""

import argparse
import collections
import concurrent.futures
import json
import pathlib
import re
import shutil
import subprocess
import sys
import time

import numpy as np

sys.path.insert(0, str(pathlib.Path(__file__).resolve().parents[1]))

from drawn_scenes import draw_case
from field_check import faults
from scene_tools import CRASH, PROGRAM, ROOT, Run, overrides

#: Seconds that a run may take.
PATIENCE = 30.0


def judge_seed(seed, folder, patience=PATIENCE, **parameters):
    """Run the case of a seed: what the program says, and what is wrong with it."""
    case = draw_case(seed)
    folder.mkdir(parents=True, exist_ok=True)
    deck = case.scene.deck(case.sides).write(folder / "scene.inp")
    result = {"seed": seed, **case.kind, "faults": {}}
    began = time.monotonic()
    try:
        done = subprocess.run([PROGRAM, deck, "--quiet", "--output", folder,
                               *overrides(case.parameters | parameters)], capture_output=True, text=True,
                              timeout=patience)
    except subprocess.TimeoutExpired:
        return result | {"verdict": "stopped", "why": "time limit", "seconds": patience}
    result["seconds"] = round(time.monotonic() - began, 2)
    said = done.stdout + done.stderr
    if CRASH.search(said):
        return result | {"verdict": "stopped", "why": "crash"}
    if done.returncode not in (0, 3):
        return result | {"verdict": "stopped", "why": f"exit code {done.returncode}: {said[-300:]}"}
    run = Run(folder / "scene", done.stderr)
    verdict = run.verdict
    if verdict["verdict"] == "not completed":
        return result | {"verdict": "stopped", "why": verdict["message"]}
    cut = run.history["cuts"] > 0
    return result | {"cuts": int(run.history["cuts"].sum()), "verdict": verdict["verdict"], "reasons": verdict["reasons"],
                     "warnings": verdict["warnings"], "penetration": verdict["penetration"],
                     "faults": faults(case, run.fields(), cut)}


def reason_of(text):
    """A message without its numbers, labels and names, to count it by."""
    text = re.sub(r"with h = \S+ the smallest allowed, ", "", text)
    text = re.sub(r"[-+]?\d+(\.\d*)?([Ee][-+]?\d+)?", "N", text)
    return text[:110]


def is_told(result):
    """Is directions of forces all that is wrong, and does a warning say that they act across gaps?"""
    return set(result["faults"]) == {"push"} and any(
        text.startswith("contact forces act across gaps") for text in result["warnings"])


def table(results):
    """Lines that sum up `results`, and the seeds that are to be looked at."""
    lines, count = [], collections.Counter()
    for r in results:
        state = r["verdict"]
        if state == "good" and r["warnings"]:
            state = "warned"
        count[r["formulation"], state] += 1
        count["all", state] += 1
    states = ("good", "warned", "bad", "stopped")
    lines.append(f"{'':16}" + "".join(f"{s:>9}" for s in states))
    for row in ["NODE TO SURFACE", "ALL", "SEGMENT", "MORTAR", "all"]:
        lines.append(f"{row:16}" + "".join(f"{count[row, s]:9d}" for s in states))
    wrong = [r for r in results if r["verdict"] == "good" and r["faults"]]
    right = [r for r in results if r["verdict"] == "bad" and not r["faults"]]
    bad = [r for r in results if r["verdict"] == "bad"]
    lines.append(f"increments cut: {sum(r.get('cuts', 0) for r in results)}")
    told = [r for r in wrong if is_told(r)]
    wrong = [r for r in wrong if not is_told(r)]
    for which, found in [("called good", wrong), ("warned of", told)]:
        lines.append(f"wrong and {which}: {len(found)}")
        lines += [f"  seed {r['seed']}: {'; '.join(r['faults'].values())}" for r in found]
    lines.append(f"called bad: {len(bad)}, {100*len(bad)/max(1, len(results)):.1f} %; "
                 f"right and called bad: {len(right)}")
    lines += [f"  seed {r['seed']}: {'RIGHT ' if not r['faults'] else ''}{'; '.join(r['reasons'])}"
              for r in bad]
    stopped = collections.defaultdict(list)
    for r in results:
        if r["verdict"] == "stopped":
            stopped[reason_of(r["why"])].append(r["seed"])
    lines.append(f"stopped: {sum(map(len, stopped.values()))}")
    lines += [f"  {len(seeds)}: {why} (seeds {', '.join(map(str, seeds))})"
              for why, seeds in sorted(stopped.items(), key=lambda item: -len(item[1]))]
    return lines, wrong


def main():
    parser = argparse.ArgumentParser(description=__doc__.split("\n", maxsplit=1)[0])
    parser.add_argument("--seeds", type=int, nargs=2, default=(1, 500), metavar=("FIRST", "LAST"))
    parser.add_argument("--folder", type=pathlib.Path, default=ROOT / "build" / "soak")
    parser.add_argument("--jobs", type=int, choices=(1, 2), default=1)
    parser.add_argument("--again", action="store_true", help="begin anew")
    parser.add_argument("--method", help="of *CONSTRAINT METHOD, in place of that of the decks")
    parser.add_argument("--keep", action="store_true", help="keep the files of all runs")
    options = parser.parse_args()
    options.folder.mkdir(parents=True, exist_ok=True)
    kept = options.folder / "results.jsonl"
    if options.again:
        kept.unlink(missing_ok=True)
    known = {}
    if kept.exists():
        known = {r["seed"]: r for r in map(json.loads, kept.read_text().splitlines())}
    seeds = range(options.seeds[0], options.seeds[1] + 1)
    parameters = {"method": options.method} if options.method else {}

    def one(seed):
        folder = options.folder / str(seed)
        result = judge_seed(seed, folder, **parameters)
        is_fine = result["verdict"] == "good" and not result["faults"]
        if is_fine and not options.keep:
            shutil.rmtree(folder)
        return result

    with kept.open("a") as file, concurrent.futures.ThreadPoolExecutor(options.jobs) as pool:
        for result in pool.map(one, [s for s in seeds if s not in known]):
            known[result["seed"]] = result
            file.write(json.dumps(result) + "\n")
            file.flush()
    lines, wrong = table([known[s] for s in seeds])
    print("\n".join(lines))
    return 1 if wrong else 0


if __name__ == "__main__":
    sys.exit(main())
