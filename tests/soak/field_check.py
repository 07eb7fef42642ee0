"""Is a run of a drawn scene right? Judged by its fields alone: positions, velocities and forces.

`faults(case, fields, ...)` names what is wrong, empty if nothing is. Mass, strain energy, stresses and
gravity are integrated here by numpy, from the deck's mesh and the law of its text; nothing that
the program says about itself is read. The checks:

 - overlap: no body is in another, at the end of an increment, by more than `TOUCHING` of an edge, or
   `OF_MEANS` where the formulation closes gaps in the mean;
 - balance, static: at every node internal forces, weight, contact and supports add up to nothing;
 - balance, dynamic: each body's momentum changes by the forces on it;
 - momenta: linear and angular momentum stay, where nothing is held and nothing pulls;
 - energy: it stays without friction, and never grows with it;
 - push and Coulomb's law: each force on a node lies between the normals that surfaces have there,
   widened by the angle of friction; means of gaps add what `Check.look_at_directions` derives.
"""

import collections

import numpy as np
import overlap
from plain_scenes import ALL

#: So far, by the edge, bodies may be in each other: where the nodes of both sides are held, and where
#: means of gaps leave something open between the nodes.
TOUCHING, OF_MEANS = 1e-3, 5.5e-2
#: Of sums of forces and momenta, by their largest parts; Newton's method stops at 1e-10.
BALANCE = 1e-7
ENERGY = 1e-9
#: Of directions of forces [rad], beside what edges turn in an increment.
ANGLE = 5e-3
#: Forces that are judged, by the largest: where a node slides along an edge, the two ends share its
#: force along the edge and across it otherwise, so that a small one has any direction.
JUDGED = 0.05
#: Edges meet in means of gaps whose normals are opposite by this cosine.
FACING = 0.25

POINT = np.array([[-1.0, -1.0], [1.0, -1.0], [1.0, 1.0], [-1.0, 1.0]])/np.sqrt(3.0)
CORNER = np.array([[-1.0, -1.0], [1.0, -1.0], [1.0, 1.0], [-1.0, 1.0]])


def shapes():
    """Values (point, node) and slopes (point, node, axis) of the bilinear square."""
    p, c = POINT[:, None], CORNER[None]
    value = 0.25*(1 + p[..., 0]*c[..., 0])*(1 + p[..., 1]*c[..., 1])
    slope = 0.25*np.stack([c[..., 0]*(1 + p[..., 1]*c[..., 1]),
                           c[..., 1]*(1 + p[..., 0]*c[..., 0])], axis=-1)
    return value, slope


VALUE, SLOPE = shapes()


class Solid:
    """The four-node elements of a scene, in plane strain, by its own integrals."""

    def __init__(self, scene, number):
        self.x = np.zeros((len(number), 2))
        cell, modulus, density, self.body, self.rigid = [], [], [], [], []
        self.names = list(scene.part)
        for k, (name, part) in enumerate(scene.part.items()):
            for label, place in part.node.items():
                self.x[number[label]] = place
            for nodes in part.element.values():
                cell.append([number[n] for n in nodes])
                modulus.append(scene.stuff[name][0] if name not in scene.reference else 0.0)
                density.append(scene.stuff[name][1])
                self.body.append(k)
        self.cell, self.body = np.array(cell), np.array(self.body)
        nu = 0.3
        self.mu = np.array(modulus)/(2*(1 + nu))
        self.lam = np.array(modulus)*nu/((1 + nu)*(1 - 2*nu))
        self.density = np.array(density)
        jacobian = np.einsum("pna,enb->epba", SLOPE, self.x[self.cell])
        self.weight = np.linalg.det(jacobian)                    # (element, point)
        self.grad = np.einsum("pna,epab->epnb", SLOPE, np.linalg.inv(jacobian))
        self.mass = np.einsum("e,ep,pn,pm->enm", self.density, self.weight, VALUE, VALUE)

    def deformation(self, u):
        return np.eye(2) + np.einsum("ena,epnb->epab", u[self.cell], self.grad)

    def strain_energy(self, u):
        f = self.deformation(u)
        log_j = np.log(np.linalg.det(f))
        density = 0.5*self.mu[:, None]*((f*f).sum((-1, -2)) - 2) - self.mu[:, None]*log_j \
            + 0.5*self.lam[:, None]*log_j**2
        return (self.weight*density).sum()

    def internal_force(self, u):
        """Nodal forces that stresses need from outside."""
        f = self.deformation(u)
        back = np.linalg.inv(f).swapaxes(-1, -2)
        log_j = np.log(np.linalg.det(f))[..., None, None]
        stress = self.mu[:, None, None, None]*(f - back) \
            + self.lam[:, None, None, None]*log_j*back
        return self.gather(np.einsum("ep,epab,epnb->ena", self.weight, stress, self.grad), len(u))

    def gather(self, of_cell, n):
        force = np.zeros((n, 2))
        np.add.at(force, self.cell, of_cell)
        return force

    def nodal_momentum(self, v):
        return np.einsum("enm,ema->ena", self.mass, v[self.cell])

    def kinetic_energy(self, v):
        return 0.5*(v[self.cell]*self.nodal_momentum(v)).sum()

    def nodal_mass(self, n):
        mass = np.zeros(n)
        np.add.at(mass, self.cell, self.mass.sum(2))
        return mass


class Check:
    """The fields of a run beside what is right."""

    def __init__(self, case, fields):
        self.scene, self.fields = case.scene, fields
        self.has_means = case.kind["formulation"] in ("SEGMENT", "MORTAR")
        self.is_dual = self.has_means and case.parameters.get("multiplier") != "STANDARD"
        labels = [n for part in self.scene.part.values() for n in part.node]
        labels += [label for label, _ in self.scene.reference.values()]
        self.number = {label: k for k, label in enumerate(sorted(labels))}
        self.solid = Solid(self.scene, self.number)
        for _, (label, place) in self.scene.reference.items():
            self.solid.x[self.number[label]] = place
        assert np.allclose(self.solid.x, fields.x, rtol=0, atol=1e-12)
        self.u, self.v = fields["displacement"], fields["velocity"]
        self.support, self.moment = fields["reaction_force"], fields["reaction_moment"]
        n_frame, n_node = self.u.shape[:2]
        self.contact = fields["contact_force"] if "contact_force" in fields.names() \
            else np.zeros((n_frame, n_node, 2))
        self.pressure = fields["contact_pressure"] if "contact_pressure" in fields.names() \
            else np.zeros((n_frame, n_node))
        self.mass = self.solid.nodal_mass(n_node)
        self.of_body = []
        for name, part in self.scene.part.items():
            nodes = [self.number[n] for n in part.node]
            if name in self.scene.reference:
                nodes.append(self.number[self.scene.reference[name][0]])
            self.of_body.append(np.array(nodes))
        self.bodies = overlap.Bodies(self.solid.cell)
        self.found = collections.OrderedDict()

    def tell(self, what, value, text):
        """Keep the worst of each kind."""
        if what not in self.found or value > self.found[what][0]:
            self.found[what] = (value, f"{what}: {text}")

    # ---- overlap

    def look_at_overlap(self, meets_itself):
        alone = () if meets_itself else {(i, i) for i in range(self.bodies.n)}
        x = self.solid.x + self.u
        deepest = max(self.bodies.overlap(x[k], self.fields.time[k], alone)
                      for k in range(len(x)))
        if deepest.by_edge > (OF_MEANS if self.has_means else TOUCHING):
            self.tell("overlap", deepest.by_edge, str(deepest))

    # ---- forces

    def look_at_statics(self):
        """Balance at every node, or of rigid bodies as a whole, of force and moment."""
        x = self.solid.x + self.u
        scale = max(np.abs(self.contact).max(), np.abs(self.support).max(), 1e-6*self.solid.mu.max())
        for k in range(1, len(x)):
            left = -self.solid.internal_force(self.u[k]) + self.contact[k] + self.support[k]
            left[:, 1] -= self.scene.gravity*self.mass
            for name, nodes in zip(self.scene.part, self.of_body, strict=True):
                if name not in self.scene.reference:
                    off = np.abs(left[nodes]).max()
                else:
                    about = self.number[self.scene.reference[name][0]]
                    arm = x[k][nodes] - x[k][about]
                    turn = overlap.cross(arm, left[nodes]).sum() + self.moment[k][about].sum()
                    off = max(np.abs(left[nodes].sum(0)).max(), abs(turn)/np.abs(arm).max())
                if off > BALANCE*scale:
                    self.tell("balance", off/scale, f"{name} by {off/scale:.2e} of the largest "
                              f"force at time {self.fields.time[k]:.6g}")

    def look_at_dynamics(self, cut):
        """Momentum of each body by the forces of each increment that was not `cut`."""
        n = self.u.shape[1]
        momentum = [self.solid.gather(self.solid.nodal_momentum(v), n) for v in self.v]
        scale = max(np.abs(p[nodes]).sum() for p in momentum for nodes in self.of_body)
        for k in range(1, len(self.u)):
            if cut[k]:
                continue
            h = self.fields.time[k] - self.fields.time[k - 1]
            force = self.contact[k] + self.support[k]
            force[:, 1] -= self.scene.gravity*self.mass
            for name, nodes in zip(self.scene.part, self.of_body, strict=True):
                change = (momentum[k] - momentum[k - 1])[nodes].sum(0)
                off = np.abs(change - h*force[nodes].sum(0)).max()
                by = max(scale, h*np.abs(force[nodes]).max())
                if off > BALANCE*by and off > 0:
                    self.tell("balance", off/by, f"momentum of {name} by {off/by:.2e} "
                              f"at time {self.fields.time[k]:.6g}")

    def look_at_momenta(self):
        if self.scene.held or self.scene.gravity:
            return
        n = self.u.shape[1]
        sums = []
        for u, v in zip(self.u, self.v, strict=True):
            p = self.solid.gather(self.solid.nodal_momentum(v), n)
            # Of a consistent mass: places and velocities by the same integrals.
            x = self.solid.x + u
            turn = overlap.cross(x, p).sum()
            sums.append([*p.sum(0), turn, np.abs(p).sum()])
        sums = np.array(sums)
        off = np.abs(sums[:, :3] - sums[0, :3]).max(1)
        k = int(np.argmax(off))
        if off[k] > BALANCE*sums[:, 3].max():
            self.tell("momenta", off[k], f"change by {off[k]/sums[:, 3].max():.2e} until time "
                      f"{self.fields.time[k]:.6g}")

    # ---- energy

    def look_at_energy(self):
        n = self.u.shape[1]
        mass = self.mass[:n]
        total, largest = [], 0.0
        for u, v in zip(self.u, self.v, strict=True):
            kinetic, strain = self.solid.kinetic_energy(v), self.solid.strain_energy(u)
            largest = max(largest, kinetic + strain)
            total.append(kinetic + strain + self.scene.gravity*(mass*u[:, 1]).sum())
        change = np.diff(total)
        if not largest > 0:
            return
        grown = (np.array(total) - np.minimum.accumulate(total)).max()
        lost = 0.0 if self.scene.friction else np.ptp(total)
        off = max(grown, lost)/largest
        if off > ENERGY:
            k = int(np.argmax(np.abs(change)))
            self.tell("energy", off, f"changes by {off:.2e} of the largest, most at time "
                      f"{self.fields.time[k + 1]:.6g}")

    # ---- directions of forces

    def look_at_directions(self, meets_itself):
        """Each contact force pushes, within the cones of friction of the surfaces around.

        Means of gaps over an edge make two more forces, no larger than `of_means` at a node. The
        length of the edge is one of the motion: along itself it is pulled by its pressure times what
        the gap is off its mean, which is half of the edge times the tangent of the angle between the
        surfaces at most. And the pressure of dual multipliers, which is linear on an edge, from 2p-q
        to 2q-p with p and q at its nodes, pulls where that is negative.

        A node of the other side that goes from one edge to the next in a step rubs along both: of
        its friction the vertex between them may have all, whatever it has of the push.
        """
        if not np.abs(self.contact).max() > 0:
            return
        phi = np.arctan(self.scene.friction)
        body_of_node = {int(n): b for edge, b in zip(self.bodies.edge, self.bodies.body_of_edge,
                                                     strict=True) for n in edge}
        largest = np.abs(self.contact).max()
        for k in range(1, len(self.u)):
            size = np.linalg.norm(self.contact[k], axis=1)
            for i in np.nonzero(size > JUDGED*largest)[0]:
                if int(i) not in body_of_node:
                    self.tell("push", 4.0, f"a force in a node {i} that no outline has")
                    continue
                way = np.angle(complex(*self.contact[k][i]))
                normal = np.concatenate([self.normals_at(frame, i, body_of_node, meets_itself)
                                         for frame in (k - 1, k)])
                off = outside_arc(way, normal) - phi
                if off <= ANGLE:
                    continue
                if self.has_means and size[i]*np.sin(min(off, np.pi/2)) <= self.of_means(k, i):
                    continue
                if size[i]*np.sin(min(off, np.pi/2)) <= self.of_passing(k, i, body_of_node):
                    continue
                self.tell("push", off, f"the force on node {i} (from 0) at time "
                          f"{self.fields.time[k]:.6g} is {np.degrees(off):.3g} degrees out of "
                          f"the cone, {size[i]/largest:.2e} of the largest")

    def of_passing(self, k, i, body_of_node):
        """The friction of the nodes of other bodies that pass node `i` in the step to frame `k`."""
        own = body_of_node[int(i)]
        edge = self.bodies.edge[self.bodies.body_of_edge == own]
        others = [n for n, body in body_of_node.items()
                  if body != own and np.any(self.contact[k][n])]
        if not others:
            return 0.0
        nearest = []
        for frame in (k - 1, k):
            x = self.solid.x + self.u[frame]
            nearest.append([edge[np.argmin(overlap.to_edges(x[n][None], x[edge[:, 0]],
                                                            x[edge[:, 1]])[0])] for n in others])
        passes = [not np.array_equal(a, b) and (i in a or i in b)
                  for a, b in zip(*nearest, strict=True)]
        return self.scene.friction*np.linalg.norm(self.contact[k][others][passes], axis=1).sum()

    def of_means(self, k, i):
        """How far out of the cone means of gaps may push node `i` in the step to frame `k`: by the
        length of its own edges, and by negative pressures over the edges that its own ones may face,
        across a gap no longer than they are."""
        edge, found = self.bodies.edge, 0.0
        p = np.sort(self.pressure[k][edge], axis=1)              # (edge, node) ascending
        x = self.solid.x + self.u[k]
        a, b = x[edge[:, 0]], x[edge[:, 1]]
        length, normal = np.linalg.norm(b - a, axis=1), (b - a)[:, ::-1]*[1.0, -1.0]
        own = (edge == i).any(1)
        near = overlap.to_edges(x[i][None], a, b)[0] < length + length[own].max()
        if self.is_dual:
            below = np.maximum(p[:, 1] - 2*p[:, 0], 0.0)
            with np.errstate(divide="ignore", invalid="ignore"):
                found = np.where(below > 0, length*below**2/(6*(p[:, 1] - p[:, 0])), 0.0)[near].sum()
        other = near & (self.bodies.body_of_edge != self.bodies.body_of_edge[own][0])
        for e in np.nonzero(own)[0]:
            facing = -(normal[other] @ normal[e])/(length[other]*length[e])
            facing = facing[facing > FACING]
            if len(facing):
                found += 0.5*np.sqrt(1 - min(facing.min(), 1.0)**2)/facing.min() \
                    * 0.5*length[e]*p[e].sum()
        return found

    def normals_at(self, k, i, body_of_node, meets_itself):
        """Directions along which node `i` may be pushed in frame `k` [rad]."""
        edge = self.bodies.edge
        x = self.solid.x + self.u[k]
        a, b = x[edge[:, 0]], x[edge[:, 1]]
        along = b - a
        out = np.angle(along[:, 1] - 1j*along[:, 0])             # the body is to the left
        length = np.linalg.norm(along, axis=1)
        own = (edge == i).any(1)
        reach = max(length[own].max(), length.max())
        near = (overlap.to_edges(x[i][None], a, b)[0] < reach) & ~own
        if not meets_itself:
            near &= self.bodies.body_of_edge != body_of_node[int(i)]
        return np.concatenate([out[own] + np.pi, out[near]])


def outside_arc(way, normal):
    """How far the direction `way` is outside the shortest arc that covers `normal` [rad]."""
    angle = np.sort(np.mod(normal, 2*np.pi))
    gap = np.diff(np.append(angle, angle[0] + 2*np.pi))
    k = int(np.argmax(gap))                                      # the arc is all but this gap
    if gap[k] < np.pi:
        return 0.0                                               # normals all around
    start, width = angle[(k + 1) % len(angle)], 2*np.pi - gap[k]
    behind = np.mod(way - start, 2*np.pi)
    return 0.0 if behind <= width else min(behind - width, 2*np.pi - behind)


def faults(case, fields, cut):
    """What is wrong with a run: a dictionary of texts by kind, empty if it is right.

    `cut` (n_frame) says which increments were cut: their forces are those of their last part.
    """
    check = Check(case, fields)
    meets_itself = case.sides == ALL
    check.look_at_overlap(meets_itself)
    if case.scene.is_static:
        check.look_at_statics()
    else:
        check.look_at_dynamics(cut)
        check.look_at_momenta()
        check.look_at_energy()
    check.look_at_directions(meets_itself)
    return {what: text for what, (_, text) in check.found.items()}
