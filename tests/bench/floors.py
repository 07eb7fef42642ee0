"""The least time that a phase of the ring's run can take: what it must compute and move.

Counted from the sizes of the mesh and from what the run did; the rates are those that numpy
reaches on one thread: of a product of matrices, and of sums of vectors as long as the data.
"""

import math
import sys

import numpy as np
from bench_counts import INCREMENTS, ring_run
from bench_peers import cells
from book.common import table
from peers.ring import ring_of
from scipy.sparse import coo_matrix, identity, kron
from scipy.sparse.linalg import splu
from timing import usage

#: Of one four-node element, neo-Hookean, with 2 x 2 points, counted from docs/theory.md, section 3:
#: two gradients (64), two C (18), invariants (10), a difference of logarithms (25), coefficients
#: (15), stress (12), mean gradient and its product (16), forces (32), at each point.
FLOPS = 4*192
#: Of a kept entry of the factor: of double precision with its row, of single precision in a dense
#: block; these are taken from so many operations for each entry on.
ENTRY, BLOCK_ENTRY, LEAST_DENSITY = 12, 4, 32
#: Vectors that a correction and its mixing read and write.
VECTORS = 30
PHASES = ("residual", "assemble", "factorise", "solve", "vectors")

RATES = """
import sys, time
import numpy as np

def best(f, n):
    least = 1e9
    for _ in range(n):
        begin = time.perf_counter()
        f()
        least = min(least, time.perf_counter() - begin)
    return least

a = np.ones((512, 512))
flops = 2*512**3/best(lambda: a @ a, 20)
n = max(int(sys.argv[1])//24, 1000)
x, y, z = np.ones((3, n))
print(flops, 24*n/best(lambda: np.add(x, y, z), 200))
"""


def rates(size):
    """Operations, and bytes of data of `size` bytes, per second."""
    done = usage([sys.executable, "-c", RATES, int(size)])
    return map(float, done.text.split())


def factor_columns(ring):
    """Entries of each column of the Cholesky factor, by an ordering of least degree."""
    free = {a: k for k, a in enumerate(sorted(set(ring.node) - set(ring.bottom)))}
    rows, columns = [], []
    for nodes in ring.element.values():
        at = [free[a] for a in nodes if a in free]
        rows += [p for p in at for _ in at]
        columns += at*len(at)
    n = len(free)
    graph = coo_matrix((np.ones(len(rows)), (rows, columns)), shape=(n, n))
    # Both unknowns of a node; a heavy diagonal, so that nothing is exchanged.
    full = (kron(graph, np.ones((2, 2))) + 1000*identity(2*n)).tocsc()
    factor = splu(full, permc_spec="MMD_AT_PLUS_A", diag_pivot_thresh=0.0,
                  options={"SymmetricMode": True})
    return np.diff(factor.L.indptr)


def least_times(size, counts):
    """Seconds per increment of each phase in PHASES; entries of the factor; rates."""
    ring = ring_of(*map(cells, size))
    n, column = len(ring.element), factor_columns(ring)
    held = int(column.sum())
    work = float((column.astype(float)**2).sum())
    entry = BLOCK_ENTRY if work >= LEAST_DENSITY*held else ENTRY
    flops, speed = rates(held*entry)
    tangent = n*64*8*2 + 18*ring.unknowns*8
    least = {"residual": counts["residuals"]*n*FLOPS/flops,
             "assemble": counts["tangents"]*tangent/speed,
             "factorise": counts["factorisations"]*work/flops,
             "solve": counts["solutions"]*2*held*entry/speed,
             "vectors": counts["solutions"]*VECTORS*8*ring.unknowns/speed}
    return {name: least[name]/INCREMENTS for name in PHASES}, held, flops, speed


def growth(unknowns, total):
    """The exponents by which both of `total`, found and least, have grown with the unknowns."""
    if len(total) < 2:
        return "-"
    size = math.log(unknowns[-1]/unknowns[0])
    return ", ".join(f"{math.log(last/first)/size:.2f}"
                     for first, last in zip(total[0], total[-1], strict=True))


def floors(sizes):
    """Lines of the table."""
    heads, columns, all_unknowns, total = ["phase"], [], [], []
    for size in sizes:
        unknowns, seconds, counts, written = ring_run(*size)
        least, held, flops, speed = least_times(size, counts)
        heads.append(f"{unknowns} unknowns")
        figures = [f"{1e3*seconds[name]/INCREMENTS:.3g} ms, {1e3*least[name]:.2g} ms"
                   for name in PHASES]
        all_unknowns.append(unknowns)
        total.append([1e3*sum(times[name] for name in PHASES)/n
                      for times, n in ((seconds, INCREMENTS), (least, 1))])
        figures += ["{:.3g} ms, {:.2g} ms".format(*total[-1]), growth(all_unknowns, total)]
        columns.append([*figures, f"{1e3*seconds['output']/INCREMENTS:.3g} ms, "
                        f"{1e-3*written/INCREMENTS:.0f} kB", held, f"{1e-9*flops:.0f}",
                        f"{1e-9*speed:.0f}"])
    names = (*PHASES, "all of these", "exponents from the smallest on", "output",
             "entries of the factor", "10^9 operations per second", "GB per second")
    return table(heads, zip(names, *columns, strict=True))
