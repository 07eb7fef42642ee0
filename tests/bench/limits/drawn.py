"""Plain scenes of the plane drawn out into space."""

from balls import add_ball
from plain_scenes import Scene


def lifted(point, middle=None):
    """A point of the plane in space: the height is the last coordinate, the one between is `middle`, or
    that along the plane."""
    return (point[0], point[0] if middle is None else middle, point[-1])


class SpaceScene(Scene):
    """Discs are balls, blocks as deep as they are wide; heights are along z, what the plane calls x is x.

    Velocities, places to hold and shapes are those of the plane.
    """

    #: How far balls stand off the plane of the drawing, by their x, so that nothing is symmetric.
    ASIDE = 0.4

    def disc(self, name, centre, radius, cells, velocity=(0, 0), **more):
        n = cells[1]

        def fill(part, first):
            """Its lowest nodes are where those of the disc are: of n + 1 cells there may be none at the pole."""
            add_ball(part, radius, lifted(centre, self.ASIDE*centre[0]), (n + 1, n), first)
            down = centre[1] - radius - min(z for *_, z in part.node.values())
            part.node = {label: (x, y, z + down) for label, (x, y, z) in part.node.items()}

        return self.add(name, fill, velocity=lifted(velocity, 0.5*velocity[0]), **more)

    def block(self, name, corner, size, cells, shape=None, velocity=(0, 0), **more):
        def place(x):
            drawn = x.copy()
            for k, (a, _, b) in enumerate(x):
                drawn[k, [0, 2]] = shape(a, b)
            return drawn

        return self.box(name, lifted(corner), lifted(size), lifted(cells), shape and place,
                        velocity=lifted(velocity, 0.5*velocity[0]), **more)

    def hold(self, name, where, axes=None, value=0.0):
        return super().hold(name, lambda x, _, z: where(x, z), axes, value)
