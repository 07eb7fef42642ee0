"""The ring for Kratos: TotalLagrangianElement2D4N, mortar contact by augmented multipliers.

Bossak's scheme with the damping of its default. The model is written here; `kratos_run.py` runs
it in a Python interpreter that has the packages.
"""

import json
import pathlib
import re

import make_ring
from peers.ring import NU, YOUNG, Told
from timing import usage

SCRIPT = pathlib.Path(__file__).with_name("kratos_run.py")
#: The quickest of the direct solvers in its packages, of those that were tried on this scene.
SOLVER = "skyline_lu_factorization"
BEFORE = 4


def version(python):
    """Of the packages of the interpreter `python`, None where they are not there."""
    if not python or not pathlib.Path(python).exists():
        return None
    done = usage([python, SCRIPT, "--version"])
    told = re.search(r"^version (\d+\.\d+\.\d+)", done.text, re.MULTILINE)
    return told[1] if told else None


def block(name, *lines):
    """A part of an mdpa file: Begin NAME ... End, NAME being its first word."""
    return [f"Begin {name}", *map(str, lines), f"End {name.split()[0]}"]


def part(name, nodes, elements=()):
    return block(f"SubModelPart {name}", *block("SubModelPartNodes", *nodes),
                 *block("SubModelPartElements", *elements))


def mesh(scene):
    """Text of the mdpa file."""
    ring = set(scene.ring)
    rim = sorted({a for k in scene.outer for a in scene.element[k][:2]})
    top = sorted({a for k in scene.top for a in scene.element[k][2:]})
    lines = [*block("ModelPartData"), *block("Properties 1"), *block("Properties 2"),
             *block("Nodes", *(f"{a} {x!r} {y!r} 0.0" for a, (x, y) in scene.node.items())),
             *block("Elements TotalLagrangianElement2D4N",
                    *(" ".join(map(str, (k, 1 if k in ring else 2, *a)))
                      for k, a in scene.element.items())),
             *part("RING", scene.nodes_of(scene.ring), scene.ring),
             *part("BLOCK", scene.nodes_of(scene.block), scene.block),
             *part("RIM", rim), *part("CONTACT", rim + top), *part("BOTTOM", scene.bottom)]
    return "\n".join(lines) + "\n"


def materials():
    return {"properties": [
        {"model_part_name": f"Structure.{name}", "properties_id": k,
         "Material": {"constitutive_law": {"name": "HyperElasticPlaneStrain2DLaw"},
                      "Variables": {"YOUNG_MODULUS": young, "POISSON_RATIO": NU,
                                    "DENSITY": make_ring.DENSITY, "THICKNESS": 1.0},
                      "Tables": {}}}
        for k, (name, young) in enumerate(zip(("RING", "BLOCK"), YOUNG, strict=True), start=1)]}


def parameters(h, increments):
    solver = {
        "model_part_name": "Structure", "domain_size": 2, "solver_type": "Dynamic",
        "scheme_type": "bossak", "analysis_type": "non_linear", "echo_level": 0,
        "time_stepping": {"time_step": h}, "rotation_dofs": False,
        "model_import_settings": {"input_type": "mdpa", "input_filename": "ring"},
        "material_import_settings": {"materials_filename": "materials.json"},
        "contact_settings": {"mortar_type": "ALMContactFrictionless",
                             "fancy_convergence_criterion": False},
        "clear_storage": True, "reform_dofs_at_each_step": True, "compute_reactions": False,
        "convergence_criterion": "contact_residual_criterion", "max_iteration": 30,
        "displacement_relative_tolerance": 1e-5, "displacement_absolute_tolerance": 1e-9,
        "residual_relative_tolerance": 1e-5, "residual_absolute_tolerance": 1e-9,
        "linear_solver_settings": {"solver_type": SOLVER}}
    held = {"python_module": "assign_vector_variable_process",
            "kratos_module": "KratosMultiphysics",
            "Parameters": {"model_part_name": "Structure.BOTTOM", "variable_name": "DISPLACEMENT",
                           "constrained": [True]*3, "value": [0.0]*3, "interval": [0.0, "End"]}}
    contact = {"python_module": "alm_contact_process",
               "kratos_module": "KratosMultiphysics.ContactStructuralMechanicsApplication",
               "Parameters": {"model_part_name": "Structure", "contact_type": "Frictionless",
                              "contact_model_part": {"0": ["CONTACT"]},
                              "assume_master_slave": {"0": ["RIM"]}}}
    return {"problem_data": {"problem_name": "ring", "parallel_type": "OpenMP", "start_time": 0.0,
                             "end_time": h*(increments - 0.5), "echo_level": 0},
            "solver_settings": solver,
            "processes": {"constraints_process_list": [held], "contact_process_list": [contact]}}


def run(python, scene, h, increments, folder):
    (folder/"ring.mdpa").write_text(mesh(scene))
    (folder/"materials.json").write_text(json.dumps(materials()))
    (folder/"parameters.json").write_text(json.dumps(parameters(h, increments)))
    done = usage([python, SCRIPT, *map(str, make_ring.VELOCITY)], folder)
    if done.code != 0:
        raise RuntimeError(f"Kratos failed:\n{(done.text + done.errors)[-2000:]}")
    told = json.loads((folder/"told.json").read_text())
    user, iterations = told["user"][BEFORE:], told["iterations"][BEFORE:]
    return Told(sum(user)/len(user), told["energy"], sum(iterations)/len(iterations))
