"""An elastic ball under Hertz's pressure on a pole: what a ball gives less than a half space.

Hertz's law is one of half spaces. A ball is stiffer by a part of the order of a/R, which Legendre's
series of the ball tells: harmonics of pressure on a sphere, statics of small strains, what the
pressure is balanced by a uniform force on the volume (an impact: the approach is that of the centre
of mass) or by the same pressure on the other pole (the approach is that of the middle plane).
Everything by E = 1 and R = 1; tractions are along the axis, on the sphere as it was.
"""

import functools

import numpy as np

#: Radii of contact that the law is made from, and the degree of the curve through them.
RADII, DEGREE = np.array([0.02, 0.035, 0.06, 0.1, 0.16, 0.26]), 4
#: Harmonics, over the ratio of the radii.
HARMONICS = 20


def legendre(n, x):
    """P_0 to P_n at x, and their derivatives by the angle."""
    p = np.ones((n + 1, len(x)))
    p[1] = x
    for k in range(1, n):
        p[k + 1] = ((2*k + 1)*x*p[k] - k*p[k - 1])/(k + 1)
    slope = np.zeros_like(p)
    slope[1:] = np.arange(1, n + 1)[:, None]*(x*p[1:] - p[:-1])/np.sqrt(1 - x*x)
    return p, slope


def response(normal, shear, nu):
    """Harmonics of the displacement of the surface, along r and by the angle, under tractions `normal` P_n and
    `shear` dP_n; the centre of mass is at rest."""
    shear_modulus = 0.5/(1 + nu)
    lame = 2*shear_modulus*nu/(1 - 2*nu)
    out, along = np.zeros_like(normal), np.zeros_like(normal)
    out[0] = normal[0]/(3*lame + 2*shear_modulus)
    # (out, -along) r^2 (cos, sin) under a uniform force; the mean of its height is that of the ball
    a, b = np.linalg.solve([[4*lame + 4*shear_modulus, -2*lame], [shear_modulus]*2], [normal[1], shear[1]])
    out[1], along[1] = a - (a + 2*b)/5, b - (a + 2*b)/5
    m = np.arange(2, len(normal))
    rows = 2*shear_modulus*np.array([[(m + 1)*(m*m - m - 2 - 2*nu), m*(m - 1)], [m*m + 2*m - 1 + 2*nu, m - 1]])
    inner, outer = np.linalg.solve(rows.transpose(2, 0, 1), np.array([normal[2:], shear[2:]]).T[:, :, None])[:, :, 0].T
    out[2:] = inner*(m + 1)*(m - 2 + 4*nu) + outer*m
    along[2:] = inner*(m + 5 - 4*nu) + outer
    return out, along


@functools.cache
def energies(radius, nu, poles):
    """Of Hertz's pressure of this radius: energy of the ball by force squared, mean distance of the sphere
    from its tangent plane."""
    n = int(HARMONICS/radius)
    point, weight = np.polynomial.legendre.leggauss(max(80, int(3*n*radius)))
    s = (point + 1)/2                                        # pressure, 1 in the middle
    area = 2*np.pi*radius**2*s*weight/2
    sine = radius*np.sqrt(1 - s*s)
    cosine = np.sqrt(1 - sine*sine)
    p, slope = legendre(n, cosine)
    k = np.arange(n + 1.0)
    normal = -(2*k + 1)/(4*np.pi)*(p @ (s*cosine*area))
    shear = (2*k + 1)/(4*np.pi*np.maximum(k*(k + 1), 1))*(slope @ (s*sine*area))
    if poles == 2:
        normal, shear = (np.where(k % 2 == 0, 2*each, 0.0) for each in (normal, shear))
    out, along = response(normal, shear, nu)
    force = (s*area).sum()
    work = (4*np.pi/(2*k + 1)*(normal*out + k*(k + 1)*shear*along)).sum()
    return 0.5*work/poles/force**2, (s*(1 - cosine)*area).sum()/force


def complementary(force, nu, poles):
    """Least energy of pressures with this force: over the radius, a parabola through three near Hertz's."""
    hertz = (0.75*force*(1 - nu*nu))**(1/3)
    ratio = np.array([0.99, 1.0, 1.01])
    value = []
    for part in ratio:
        elastic, gap = energies(hertz*part, nu, poles)
        value.append(force**2*elastic + force*gap)
    a, b, c = np.polyfit(ratio - 1, value, 2)
    return c - b*b/(4*a)


@functools.cache
def curve(nu, poles):
    """Polynomial of log a: k in approach = a^2 (1 - a k), a the radius that Hertz has for the force."""
    values = []
    for radius in RADII:
        force, part = 4/3*radius**3/(1 - nu*nu), 0.02
        approach = (complementary(force*(1 + part), nu, poles)
                    - complementary(force*(1 - part), nu, poles))/(2*part*force)
        values.append((1 - approach/radius**2)/radius)
    return np.polyfit(np.log(RADII), values, DEGREE)


def approach_of(a, k):
    return a*a*(1 - a*np.polyval(k, np.log(np.maximum(a, 1e-9))))


def stiffer(approach, nu, poles=2):
    """Force for an approach (by R), over that of Hertz; poles 1: of the centre of mass, 2: of the middle plane."""
    a = np.linspace(0, RADII[-1], 20001)
    return (np.interp(approach, approach_of(a, curve(nu, poles)), a)/np.sqrt(approach))**3


def impact(energy, nu):
    """Time of contact and largest force of a ball that meets a rigid plane with a kinetic energy (by E R^3), over
    those of Hertz's half space; without waves."""
    found = []
    for k in (np.zeros(1), curve(nu, 1)):
        a = np.linspace(0, RADII[-1], 200001)
        approach = approach_of(a, k)
        force = 4/3*a**3/(1 - nu*nu)
        work = np.concatenate([[0], np.cumsum(0.5*(force[1:] + force[:-1])*np.diff(approach))])
        most = np.interp(energy, work, a)
        root = (np.arange(20000) + 0.5)/20000                # a = most (1 - root^2) takes the singularity away
        at = most*(1 - root**2)
        slow = np.interp(at, a, np.gradient(approach, a))/np.sqrt(1 - np.interp(at, a, work)/energy)
        found.append(((slow*root).mean()*most, most**3))
    return found[1][0]/found[0][0], found[1][1]/found[0][1]
