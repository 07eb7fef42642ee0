"""Run parameters.json of the current folder by Kratos; write told.json there.

    python kratos_run.py --version
    python kratos_run.py VX VY          # the velocity of the part RING at the start

told.json: by increments the seconds of the processor and the iterations; the energies, kinetic
and strain, at the start and after each increment, the time of whose sums is not counted.
"""

import json
import pathlib
import resource
import sys

import KratosMultiphysics as Kratos
import KratosMultiphysics.ConstitutiveLawsApplication
import KratosMultiphysics.ContactStructuralMechanicsApplication
import KratosMultiphysics.LinearSolversApplication  # noqa: F401
import numpy as np
from KratosMultiphysics.StructuralMechanicsApplication.structural_mechanics_analysis import (
    StructuralMechanicsAnalysis)


def user_seconds():
    return resource.getrusage(resource.RUSAGE_SELF).ru_utime


class Energies:
    """Kinetic energy by the mass matrices of the elements, strain energy by 2 x 2 points."""

    def __init__(self, part):
        self.part = part
        place = {node.Id: k for k, node in enumerate(part.Nodes)}
        elements = list(part.Elements)
        self.node = np.array([[place[node.Id] for node in e.GetNodes()] for e in elements])
        self.x = np.array([(node.X0, node.Y0) for node in part.Nodes])
        self.mass = np.array([self.mass_of(e) for e in elements])
        young = np.array([e.Properties[Kratos.YOUNG_MODULUS] for e in elements])
        nu = np.array([e.Properties[Kratos.POISSON_RATIO] for e in elements])
        self.mu, self.lam = young/(2 + 2*nu), young*nu/((1 + nu)*(1 - 2*nu))

    def mass_of(self, element):
        matrix = Kratos.Matrix()
        element.CalculateMassMatrix(matrix, self.part.ProcessInfo)
        return np.array(matrix)

    def field(self, x, y):
        return np.array([(node.GetSolutionStepValue(x), node.GetSolutionStepValue(y))
                         for node in self.part.Nodes])

    def total(self):
        v = self.field(Kratos.VELOCITY_X, Kratos.VELOCITY_Y)[self.node].reshape(-1, 8)
        x = self.x + self.field(Kratos.DISPLACEMENT_X, Kratos.DISPLACEMENT_Y)
        strain = 0.0
        for r in (-3**-0.5, 3**-0.5):
            for s in (-3**-0.5, 3**-0.5):
                d = np.array([[s - 1, 1 - s, 1 + s, -1 - s], [r - 1, -1 - r, 1 + r, 1 - r]])/4
                before, after = d @ self.x[self.node], d @ x[self.node]
                f = np.linalg.solve(before, after)
                log = np.log(np.linalg.det(f))
                w = self.mu/2*((f*f).sum((1, 2)) - 2 - 2*log) + self.lam/2*log**2
                strain += np.linalg.det(before) @ w
        return 0.5*np.einsum("ei,eij,ej->", v, self.mass, v) + strain


class Run(StructuralMechanicsAnalysis):
    """The analysis, watched."""

    def Initialize(self):
        super().Initialize()
        for node in self.model["Structure.RING"].Nodes:
            for step in (0, 1):
                node.SetSolutionStepValue(Kratos.VELOCITY_X, step, float(sys.argv[1]))
                node.SetSolutionStepValue(Kratos.VELOCITY_Y, step, float(sys.argv[2]))
        self.sums = Energies(self._GetSolver().GetComputingModelPart())
        self.told = {"user": [], "iterations": [], "energy": [float(self.sums.total())]}
        self.begin = user_seconds()

    def FinalizeSolutionStep(self):
        super().FinalizeSolutionStep()
        self.told["user"].append(user_seconds() - self.begin)
        info = self.sums.part.ProcessInfo
        self.told["iterations"].append(info[Kratos.NL_ITERATION_NUMBER])
        self.told["energy"].append(float(self.sums.total()))
        self.begin = user_seconds()


if __name__ == "__main__":
    if sys.argv[1] == "--version":
        print("version", Kratos.KratosGlobals.Kernel.Version().replace('"', ""))
        sys.exit()
    Kratos.Logger.GetDefaultOutput().SetSeverity(Kratos.Logger.Severity.WARNING)
    settings = Kratos.Parameters(pathlib.Path("parameters.json").read_text())
    run = Run(Kratos.Model(), settings)
    run.Run()
    pathlib.Path("told.json").write_text(json.dumps(run.told))
