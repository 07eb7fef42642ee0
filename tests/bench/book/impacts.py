"""Published benchmarks of impact and contact, with the figures that their vendors give."""

import numpy as np
from scene_tools import DECKS, Deck

from .common import Chapter, drift, mortar, node, size, table, with_print
from .forces import switches

PAGE = "impacts.md"
TREATMENTS = ("MASSLESS", "PERSISTENT", "ADMISSIBLE", "VELOCITY UPDATE")


def number_of(value, digits=1):
    return f"{value:.{digits}f}"


# ---- code_aster, SDNV100 ------------------------------------------------------------------------

#: Energy and velocity of the contact node after the impact, as the test accepts them.
SDNV100 = ((793.0, 103.6), (779.7, 129.1), (781.0, 115.3))
BAR_MASS, WAVE = 0.16, 5000.0


def start_bar(runs):
    """Courant number 1/4 of the elements on each mesh."""
    return {(treatment, n): runs.start(runs.generated("bar_on_wall", "--elements", n),
                                       initiation=treatment, h=0.25*0.2/n/WAVE)
            for treatment in TREATMENTS for n in (40, 160)}


def force_of(history):
    return np.abs(history["pair1_force_y"])


def bars(futures, _):
    rows = [("code_aster", "", number_of(energy), "", number_of(speed), "", "")
            for energy, speed in SDNV100]
    for (treatment, n), future in futures.items():
        run = future.result()
        history = run.history
        force = force_of(history)
        _, velocity = run.series("ENDS", "V")
        rows.append((f"`{treatment}`", n, number_of(history["total"][-1]),
                     number_of(history["py"][-1]/BAR_MASS),
                     number_of(velocity[-1, 0, 1]), switches(force),
                     number_of(force.max()/force[force > 0].mean(), 2)))
    rows.append(("closed form", "", "800.0", "100.0", "100.0", 2, "1.00"))
    return table(["", "elements", "energy [J]", "velocity of the bar [m/s]", "of its lower end",
                  "switches", "force, largest/mean"], rows)


# ---- ANSYS, rigid bar ---------------------------------------------------------------------------

#: Rebound and energy by Newmark's method, by the same with damping, and by HHT with damping.
METAL_BAR = (("no control", 383.25, 683.01, 220.32, 225.72, 311.58, 451.43),
             ("status of contact controls increments", 450.95, 945.63, 224.59, 234.55, 449.99,
              941.60),
             ("impact constraints, augmented Lagrange", 207.31, 199.85, 204.48, 194.43, 204.48,
              194.43),
             ("impact constraints, multipliers", 227.00, 239.61, 227.00, 239.61, 227.00, 239.61))
METAL_SCHEMES = ("Newmark", "Newmark, damped", "HHT, damped")
METAL_MASS = 2*239.61/227.0**2


def start_rigid(runs):
    return {treatment: runs.start(DECKS / "rigid_bar.inp", initiation=treatment)
            for treatment in ("PERSISTENT", "ADMISSIBLE", "VELOCITY UPDATE")}


def rigid_bars(futures, _):
    rows = [("ANSYS, " + name, scheme, number_of(found[2*k], 2), number_of(found[2*k + 1], 2))
            for k, scheme in enumerate(METAL_SCHEMES) for name, *found in METAL_BAR]
    for treatment, future in futures.items():
        history = future.result().history
        rows.append((f"`{treatment}`", "`ENERGY MOMENTUM`",
                     number_of(history["py"][-1]/METAL_MASS, 2),
                     number_of(history["total"][-1], 2)))
    return table(["", "scheme", "rebound [m/s]", "energy [J]"], rows)


# ---- Doyen, Ern, Piperno: the bar without gravity -----------------------------------------------


def thrown():
    """The bouncing bar, thrown down with velocity 10 in place of gravity."""
    deck = Deck.read(DECKS / "bouncing_bar.inp")
    deck.remove("*DLOAD")
    deck.insert("*INITIAL CONDITIONS, TYPE=VELOCITY\nBAR, 2, -10.\n", before="*STEP")
    return with_print(deck, "*NODE PRINT, NSET=LOWER_END\nU, V\n")


def start_thrown(runs):
    deck = thrown()
    return {(treatment, h): runs.start(deck, initiation=treatment, h=h, t_end=2.0, frame=1)
            for treatment in TREATMENTS for h in (0.005, 0.00125)}


def thrown_bars(futures, _):
    rows = []
    for (treatment, h), future in futures.items():
        history = future.result().history
        force = force_of(history)
        on = np.flatnonzero(force > 0)
        rows.append((f"`{treatment}`", f"{h:g}", number_of(history["py"][-1]/10, 3),
                     number_of(history["time"][on[-1]] - history["time"][on[0] - 1], 4),
                     switches(force), number_of(force[on].mean(), 1),
                     f"{100*force[on].std()/force[on].mean():.0f} %",
                     size(drift(history["total"])) if treatment != "ADMISSIBLE" else
                     f"{100*(history['total'][-1]/history['total'][0] - 1):+.2f} %"))
    return table(["treatment", "h", "rebound (10)", "duration (0.6667)", "switches (2)",
                  "mean force (300)", "scatter", "energy"], rows)


#: What the trapezoidal rule is known to make of the energy of a bar, at Courant numbers 0.5 to 1.
GROWTH = (1.8, 8.0)
COURANT = (0.5, 0.75, 1.0)
CROSSING = 0.2/30                       # of the wave through an element of the bar


def start_grown(runs):
    deck = thrown()
    return {(scheme, courant): runs.start(deck, scheme=scheme, initiation="ADMISSIBLE",
                                          h=courant*CROSSING, t_end=2.0, frame=1)
            for scheme in ("TRAPEZOIDAL", "ENERGY MOMENTUM") for courant in COURANT}


def growth(history):
    """Energy of motion and strain at the end over that at the start."""
    energy = history["kinetic"] + history["strain"]
    return energy[-1]/energy[0]


def grown_bars(futures, _):
    rows = [("known", "`TRAPEZOIDAL`", "0.5 to 1", "{:g} to {:g}".format(*GROWTH), "", "")]
    for (scheme, courant), future in futures.items():
        history = future.result().history
        rows.append(("", f"`{scheme}`", f"{courant:g}", f"{growth(history):.3f}",
                     number_of(history["py"][-1]/10, 2), switches(force_of(history))))
    return table(["", "scheme", "Courant", "energy, times", "rebound (10)", "switches (2)"], rows)


# ---- NAFEMS, roller -----------------------------------------------------------------------------

HALF_WIDTH, PEAK = 6.215, 3585.4
CHOICES = {"`NODE TO SURFACE`": node(), "`MORTAR`": mortar("NODAL", "DUAL")}


def start_roller(runs):
    decks = {level: runs.generated("roller", "--level", level) for level in (6, 12, 24)}
    return {(name, level): runs.start(deck, **choice)
            for name, choice in CHOICES.items() for level, deck in decks.items()}


def roller_contact(run):
    """Peak of the pressure, and half-width by the second moment of the force (of an ellipse: a^2/4),
    of the cylinder, whose nodes follow those of the block."""
    fields = run.fields()
    x = fields.x
    node_of = np.arange(len(x)) > np.flatnonzero(x[:, 1] < -1e-9).max() + 1
    on_arc = np.abs(np.hypot(x[:, 0], x[:, 1] - 50) - 50) < 1e-7
    arc = np.flatnonzero(node_of & on_arc)
    arc = arc[np.argsort(x[arc, 0])]
    edge = np.hypot(*np.diff(x[arc], axis=0).T)
    force = fields["contact_force"][-1][arc, 1]
    pressure = force/(0.5*(np.r_[0, edge] + np.r_[edge, 0]))
    return pressure.max(), 2*np.sqrt((force*x[arc, 0]**2).sum()/force.sum())


def rollers(futures, _):
    rows = []
    for (name, level), future in futures.items():
        peak, width = roller_contact(future.result())
        rows.append((name, level, number_of(peak), f"{100*(peak/PEAK - 1):+.2f} %",
                     number_of(width, 3), f"{100*(width/HALF_WIDTH - 1):+.2f} %"))
    rows.append(("Hertz", "", PEAK, "", HALF_WIDTH, ""))
    return table(["formulation", "elements over the half-width", "peak [N/mm^2]", "off by",
                  "half-width [mm]", "off by"], rows)


CHAPTERS = [
    Chapter("impacts_bar", start_bar, bars, PAGE),
    Chapter("impacts_rigid", start_rigid, rigid_bars, PAGE),
    Chapter("impacts_thrown", start_thrown, thrown_bars, PAGE),
    Chapter("impacts_grown", start_grown, grown_bars, PAGE),
    Chapter("impacts_roller", start_roller, rollers, PAGE),
]
