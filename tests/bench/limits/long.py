"""Rows of many increments."""

from plain_scenes import AUTO, Scene, below

from .common import Row, energy_error, one_element, with_penetration


def vibrating(n):
    """One element, pulled and let go, for `n` increments of a thirtieth of a period."""
    return one_element(cards="*BOUNDARY\n1, 1, 2\n4, 1\n*INITIAL CONDITIONS, TYPE=VELOCITY\n"
                             "2, 1, 0.5\n3, 1, 0.5\n",
                       step=f"*DYNAMIC, DIRECT\n0.02, {0.02*n!r}\n*NODE FILE, FREQUENCY=100000\nU\n")


def hopping(n):
    """A block of one element that hops on a floor under gravity."""
    scene = Scene(0.02, 0.02*n, gravity=10.0)
    scene.block("BLOCK", (0, 0.1), (1, 1), (1, 1), stiffness=1e4)
    scene.block("FLOOR", (-1, -0.5), (3, 0.5), (1, 1)).hold("FLOOR", lambda *_: True)
    scene.hold("BLOCK", lambda *_: True, axes="1")
    deck = scene.deck(AUTO)
    deck.replace("*NODE FILE\nU\n*CONTACT FILE", "*NODE FILE, FREQUENCY=100000\nU, V\n"
                                                "*CONTACT FILE, FREQUENCY=100000")
    deck.replace("*CONTACT PRINT, TOTALS", "*CONTACT PRINT, FREQUENCY=100000, TOTALS")
    return deck


ROWS = [
    Row("vibration", "increments of an element that vibrates", (1000, 10**4, 10**5, 10**6),
        vibrating, energy_error, "energy", reach=4, short=(0,)),
    Row("hops", "increments of a block that hops on a floor", (1000, 10**4, 10**5, 10**6), hopping,
        with_penetration, "energy, overlap", reach=4, short=(0,),
        parameters={"formulation": "NODE TO SURFACE"}),
]
