"""Models made by calls: the bits of decks, all that a deck can say, messages, bad input."""

from __future__ import annotations

import pickle
import re
import subprocess
import sys
from collections.abc import Callable
from pathlib import Path
from typing import Any

import numpy as np
import pytest

ROOT = Path(__file__).parents[2]
sys.path.insert(0, str(ROOT/"pywrap"))

from emcon import _core, errors  # noqa: E402
from emcon.deck_text import number, table  # noqa: E402
from emcon.mesh import block, read  # noqa: E402
from emcon.model import Model  # noqa: E402
from emcon.options import LAWS  # noqa: E402
from emcon.stepper import AnalysisError, InputError, Stepper  # noqa: E402

RING = ROOT/"input_decks"/"ring.inp"
KEYWORDS = ROOT/"src_f90"/"deck"/"emcon_deck_keywords.f90"
SQUARE = np.array([[0.0, 0.0], [1.0, 0.0], [1.0, 1.0], [0.0, 1.0]])


def ring_by_calls(h: float, formulation: str) -> Model:
    """The model of ring.inp, its mesh from arrays."""
    mesh = read(RING)
    model = Model("Impact of an elastic ring")
    model.add_nodes(mesh.nodes)
    model.add_elements(mesh.connectivity("CPE4"))
    for name in ("RING", "BLOCK"):
        model.node_set(name, mesh.rows(mesh.node_sets[name]))
        model.element_set(name, mesh.element_sets[name] - 1)
    model.node_set("BOTTOM", mesh.rows(mesh.node_sets["BOTTOM"]))
    for side, faces in mesh.surfaces.items():
        model.surface(side, faces=faces - [1, 0])
    for name, modulus, elements_of in (("SOFT", 100.0, "RING"), ("STIFF", 1e5, "BLOCK")):
        model.material(name, coupled_neo_hooke=(modulus, 0.1), density=0.01)
        model.section(name, elements_of, thickness=1.0)
    model.interaction("FRICTIONLESS")
    model.contact_pair("RING_OUTER", "BLOCK_TOP", interaction="FRICTIONLESS", type=formulation,
                       sides="ONE")
    model.boundary("BOTTOM")
    model.initial("VELOCITY", "RING", (1, 2), (2.0, -3.0))
    step = model.step("DYNAMIC", h, 8.0, direct=True, nlgeom=True, increments=1000000)
    step.constraint_method("NULL SPACE").contact_initiation("PERSISTENT").newton(tolerance=1e-10)
    step.mortar(integration="SEGMENTS", points=3, multiplier="DUAL", normal="NODAL")
    step.smoothing("NONE")
    return model


def square(nodes: Any = SQUARE, elements: Any = ((0, 1, 2, 3),), **arguments: Any) -> Model:
    """One element of a linear material, with a static step that pulls at its corner."""
    model = Model.from_arrays(nodes, np.array(elements), **arguments)
    model.material("M", elastic=(100.0, 0.3), density=1.0).section("M")
    model.boundary([0, 1])
    model.step("STATIC", 0.5).load(2, (1, 2), (1.0, -1.0))
    return model


def final(model: Model) -> np.ndarray:
    with model.stepper() as stepper:
        while not stepper.is_done:
            stepper.step()
        return stepper.u


# --- the same scene ----------------------------------------------------------------------------

@pytest.mark.parametrize("formulation", ["NODE TO SURFACE", "MORTAR"])
def test_ring_by_calls_gives_the_bits_of_the_deck(formulation: str) -> None:
    model = ring_by_calls(0.05, formulation)
    with (Stepper(RING, h=0.05, formulation=formulation, initiation="PERSISTENT") as deck,
          model.stepper() as calls):
        assert np.array_equal(deck.positions, calls.positions)
        for _ in range(8):
            assert deck.step() == calls.step()
        assert calls.pairs()[0].active > 0
        assert np.array_equal(deck.u, calls.u) and np.array_equal(deck.v, calls.v)
        assert deck.energies() == calls.energies()


def test_deck_that_is_written_gives_the_same_bits(tmp_path: Path) -> None:
    model = ring_by_calls(0.05, "MORTAR")
    model.write(tmp_path/"calls.inp")
    again = Model.from_deck(tmp_path/"calls.inp")
    assert final_after(again, 8).tolist() == final_after(model, 8).tolist()
    again.write(tmp_path/"again.inp")           # names the first deck by its full path
    assert final_after(Model.from_deck(tmp_path/"again.inp"), 8).tolist() == \
        final_after(model, 8).tolist()


def final_after(model: Model, n: int) -> np.ndarray:
    with model.stepper() as stepper:
        for _ in range(n):
            stepper.step()
        return stepper.u


def test_positions_go_through_to_the_bit() -> None:
    rng = np.random.default_rng(5)
    x = SQUARE + 1e-3*rng.standard_normal((4, 2))
    with square(x*2.0**-40).stepper() as small, square(x).stepper() as stepper:
        assert np.array_equal(stepper.positions, x)
        assert np.array_equal(small.positions, x*2.0**-40)
    values = np.concatenate([rng.standard_normal(500)*10.0**rng.integers(-300, 300, 500),
                             [0.0, -0.0, 1.0, 10.0, 1e16, 5e-324, 1.7976931348623157e308]])
    lines = table(np.arange(len(values)), values).splitlines()
    assert lines == [f"{i}, {number(value)}" for i, value in enumerate(values)]
    assert [float(line.split(",")[1]) for line in lines] == values.tolist()


def test_static_steps_of_calls_and_of_cards_agree(tmp_path: Path) -> None:
    cards = """
        *NODE, NSET=ALL
        1, 0., 0.
        2, 1., 0.
        3, 1., 1.
        4, 0., 1.
        *ELEMENT, TYPE=CPE4, ELSET=ALL
        1, 1, 2, 3, 4
        *MATERIAL, NAME=M
        *ELASTIC
        100., 0.3
        *DENSITY
        1.
        *SOLID SECTION, ELSET=ALL, MATERIAL=M
        *BOUNDARY
        1, 1, 2
        2, 1, 2
        *STEP
        *STATIC
        0.5, 1.
        *CLOAD
        3, 1, 1.
        3, 2, -1.
        *END STEP
    """
    assert np.array_equal(final(square()), final(Model().cards(cards)))
    labelled = square(node_labels=[10, 40, 7, 3], element_labels=[99])
    assert np.array_equal(final(square()), final(labelled))
    with labelled.stepper() as stepper:
        assert stepper.labels.tolist() == [10, 40, 7, 3]
    triangles = Model.from_arrays(SQUARE, {"CPE3": [[0, 1, 2], [0, 2, 3]]})
    triangles.material("M", elastic=(100, 0.3)).section("M")
    triangles.boundary(np.array([0, 1]))
    triangles.step("STATIC").gravity("ALL", 1.0)
    with pytest.raises(InputError, match="DENSITY"):
        triangles.stepper()


def test_equations_ties_and_steps_of_models_made_by_calls() -> None:
    """Two squares, one above the other: joined by equations, by a tie, or as one mesh."""
    nodes = np.concatenate([SQUARE, SQUARE + [0.0, 1.0]])
    quads = [[0, 1, 2, 3], [4, 5, 6, 7]]

    def pulled(join: Callable[[Model], object]) -> np.ndarray:
        model = Model.from_arrays(nodes, quads)
        model.material("M", elastic=(100.0, 0.3)).section("M").boundary([0, 1])
        join(model)
        model.step("STATIC").load([6, 7], 2, [1.0, 2.0])
        model.step("STATIC", 1.0, 1.0, 0.5, 1.0).load(6, 1, 0.5, op="NEW")
        return final(model)

    def tie(model: Model) -> None:
        model.surface("LOW", faces=[(0, 3)]).surface("HIGH", faces=[(1, 1)])
        model.tie("JOINT", "HIGH", "LOW", position_tolerance=1e-3)

    def equations(model: Model) -> None:
        for low, high in ((3, 4), (2, 5)):
            for dof in (1, 2):
                model.equation([(high, dof, 1.0), (low, dof, -1.0)])

    tied, coupled = pulled(tie), pulled(equations)
    assert np.abs(tied).max() > 0.0
    assert np.allclose(tied, coupled, rtol=0.0, atol=1e4*np.finfo(float).eps*np.abs(tied).max())


def test_increments_grow_up_to_the_bound_that_is_given() -> None:
    model = Model.from_arrays(SQUARE, [[0, 1, 2, 3]])
    model.material("M", elastic=(100.0, 0.3)).section("M").boundary([0, 1])
    model.step("STATIC", 0.01, 1.0, h_max=0.02).load(2, 1, 1.0)
    with model.stepper() as stepper:
        assert max(stepper.step().h for _ in range(12)) == pytest.approx(0.02, rel=1e-12)


def test_conditions_at_many_nodes_take_a_value_for_each() -> None:
    model = Model.from_arrays(SQUARE, [[0, 1, 2, 3]])
    model.material("M", elastic=(100.0, 0.3), density=1.0).section("M")
    v = np.array([[1.0, 2.0], [3.0, -4.0], [0.1, 0.2], [5e-324, 1e300]])[:3]
    model.initial("VELOCITY", [0, 1, 2], (1, 2), v)
    model.amplitude("RISE", [0.0, 1.0], [0.0, 1.0])
    step = model.step("DYNAMIC", 0.1, 0.1, direct=True)
    step.boundary([3], (1, 2), [[0.25, 0.0]], amplitude="RISE")
    with model.stepper() as stepper:
        assert np.array_equal(stepper.v[:3], v)
        stepper.step()
        assert stepper.u[3].tolist() == pytest.approx([0.025, 0.0], rel=1e-14)


def test_a_section_of_all_of_a_mesh() -> None:
    """Without a set it is for all elements, of every kind; a set of that name that the mesh has stands."""
    mesh = block((0.0, 0.0), (2.0, 1.0), (2, 1), "A") + block((3.0, 0.0), (2.0, 1.0), (2, 1), "B", kind="CPE3")
    assert len(mesh.elements) == 2
    model = Model.from_mesh(mesh).material("M", elastic=(100.0, 0.3), density=2.0).section("M", thickness=0.5)
    model.initial("VELOCITY", "ALL", 1, 3.0).step("DYNAMIC", 0.1, 0.1, nlgeom=True)
    with model.stepper() as stepper:
        assert stepper.momenta()["px"] == pytest.approx(3.0*2*2.0, rel=1e-14)
    mesh.element_sets["ALL"] = mesh.element_sets["A"]
    assert Model.from_mesh(mesh).deck().count("ELSET=ALL") == 1


def test_a_moment_turns_a_body_of_space_by_calls() -> None:
    """About the axle that two rotations at 0 leave: momentum by moment times time."""
    wheel = Model.from_mesh(block((0.0, 0.0, 0.0), (1.0, 1.0, 2.0), (1, 1, 2), "W", kind="C3D8"))
    wheel.material("M", density=1.0).section("M")
    wheel.add_nodes([(0.5, 0.5, 1.0)], labels=[99])
    wheel.rigid_body(None, 99, nodes="W").boundary(99, (1, 2, 3, 4, 5))
    wheel.step("DYNAMIC", 0.1, 1.0, direct=True, nlgeom=True).load(99, 6, 0.7)
    with wheel.stepper() as stepper:
        stepper.run()
        assert stepper.momenta()["lz"] == pytest.approx(0.7, rel=1e-12)


def test_rigid_bodies_of_space_turn_by_calls() -> None:
    """A free top: spins in degrees of freedom 4 to 6, or about an axis; then it is turned, as prescribed."""
    mesh = block((0.0, 0.0, 0.0), (1.0, 1.0, 2.0), (1, 1, 2), "TOP", kind="C3D8")
    spin, centre = (0.5, -0.25, 2.0), np.array((0.5, 0.5, 1.0))
    length = float(np.linalg.norm(spin))
    kinetic = []
    for way in ("freedoms", "axis"):
        top = Model.from_mesh(mesh).material("M", density=1.0).section("M", "TOP")
        top.add_nodes([centre], labels=[99])
        top.rigid_body(None, 99, nodes="TOP")
        if way == "axis":
            top.rotating(99, length, velocity=(1.0, 0.0, 0.0), about=(centre - spin, centre))
        else:
            top.initial("VELOCITY", 99, (1, 4, 5, 6), (1.0, *spin))
        top.step("DYNAMIC", 0.01, 0.02, direct=True, nlgeom=True)
        with top.stepper() as stepper:
            kinetic.append(stepper.energies()["kinetic"])
            stepper.run()
    # A rod of mass 2: 1/2 m v^2, and the moments of inertia 5/6, 5/6 and 1/3.
    assert kinetic == pytest.approx([1.0 + 0.5*(5/6*(0.5**2 + 0.25**2) + 2.0**2/3)]*2, rel=1e-12)
    bar = Model.from_mesh(mesh).material("M", elastic=(100.0, 0.3)).section("M", "TOP")
    bar.add_nodes([(0.5, 0.5, 2.5)], labels=[99])
    bar.rigid_body(None, 99, nodes="TOP_FRONT")
    end = mesh.node_sets["TOP_FRONT"] - 1
    bar.boundary("TOP_BACK").boundary(99, (1, 2, 3, 4, 5))
    bar.step("STATIC", 0.5, 1.0, nlgeom=True).boundary(99, 6, np.pi/6)
    with bar.stepper() as stepper:
        stepper.run()
        arm = mesh.nodes[end] - (0.5, 0.5, 2.0)
        turned = stepper.u[end] + arm
    c, s = np.cos(np.pi/6), np.sin(np.pi/6)
    assert np.allclose(turned, arm @ np.array([[c, s, 0], [-s, c, 0], [0, 0, 1]]), rtol=0, atol=1e-12)


def test_steps_can_be_added_to_the_model_of_a_deck(tmp_path: Path) -> None:
    """A deck and a mesh are named by labels."""
    path = square().write(tmp_path/"square.inp")
    model = Model.from_deck(path)
    model.step("STATIC").load(3, (1, 2), (0.0, 0.0))
    assert np.abs(final(model)).max() == 0.0
    parametric = Model.from_mesh(block(name="B"), parameters={"e": 10.0, "h": "2/4"})
    parametric.material("M", elastic=("<e>", 0.3)).section("M", "B").boundary("B_BOTTOM")
    parametric.step("STATIC", "<h>").pressure([1], 3, 1.0)
    u = final(parametric)
    written = parametric.write(tmp_path/"parametric.inp")
    assert np.array_equal(final(Model.from_deck(written)), u)
    softer = Model.from_deck(written, e=5)
    assert np.allclose(final(softer), 2.0*u, rtol=1e-10)
    with pytest.raises(InputError, match="--set e=5"):
        softer.deck()


# --- all that a deck can say -------------------------------------------------------------------

def everything() -> Model:
    """Calls of every method with every argument; not a scene that makes sense."""
    model = Model("All cards").parameter(h=0.1, method="NULL SPACE").include("none.inp")
    model.add_nodes(SQUARE)
    model.add_elements([[0, 1, 2, 3]]*3)
    model.node_set("N", [0, 1, 2]).node_set("N2", ["N", 3]).element_set("E", [0, 1, 2])
    model.element_set("E2", "E").nodes_of("N3", "E2")
    model.surface("S1", faces=[("E", 1), (0, 2)]).surface("S2", elements="E")
    model.surface("S3", nodes=[0, 1]).surface("S4", edges=[[0, 1], [1, 2]])
    model.material("A", elastic=(1.0, 0.3), density=1.0).material("B", neo_hooke=(1.0, 0.1))
    model.material("C", coupled_neo_hooke=(1.0, 0.1)).material("D", user=range(10))
    model.material("E", mooney_rivlin=(1.0, 0.1, 0.1), damping=(0.1, 0.2))
    model.material("F", yeoh=(1.0, 0.0, 0.1, 0.1, 0.0, 0.0))
    model.material("G", ogden=(1.0, 2.0, 0.1, -2.0, 0.1, 3.0, 0.1, 0.0, 0.2))
    model.section("A", "E", thickness=2.0, kinematics="LINEAR", massless=True, orientation="O")
    model.orientation("O", (1, 0, 0), (0, 1, 0))
    model.initial("DISPLACEMENT", "N", 1, 0.5)
    model.surface("S5", segments=[("START", 0.0, 0.0), ("LINE", 1.0, 0.0)], fillet_radius=0.1)
    model.rigid_body("E2", 3, nodes="N", profile="S5").rotating("N", 0.5, velocity=(1.0, 0.0), about=(0.5, 0.5))
    model.amplitude("AMP", [0.0, 1.0], [0.0, 1.0], time="TOTAL TIME", definition="SMOOTH STEP")
    model.time_points("T1", [0.5, 1.0]).time_points("T2", generate=(0.0, 1.0, "<h>"))
    model.interaction("I2", friction="rough")
    model.interaction("I3", pressure=("TABULAR", (0, 0), (5, 0.01)))
    model.interaction("I4", pressure=("LINEAR", 1e3))
    model.interaction("I", friction=0.0, friction_restitution=0.5, pad_thickness=0.0,
                      restitution=0.5, damping=(0.0, 0.1, 0.5), tangent_fraction=0.5)
    model.contact_pair("S1", "S2", interaction="I", adjust=0.1, sides="BOTH", guard="NO", edges="YES",
                       initiation="PERSISTENT")
    model.clearance("S1", "S2", 0.01)
    model.contact(interaction="I", type="NODE TO SURFACE").contact("S1", ("S1", "S2"), type="MORTAR")
    model.tie("T", "S1", "S2", position_tolerance=0.1, multiplier="DUAL")
    model.tie("CELL", "S1", "S2", translation=(1.0, 0.0), reference=1)
    model.tie("CUT", "S1", "S2", cyclic_symmetry=True).sectors(6, (0.0, 0.0), (0.0, 0.0), tie="CUT")
    model.surface("S6", stl="tool.stl", scale=0.001)
    model.equation([("N", 1, 1.0), (3, 1, -1.0)])
    model.transform("N", (1, 0, 0), (0, 1, 0))
    model.given_forces("N")
    step = model.step("DYNAMIC", "<h>", 1.0, 0.1, 0.2, direct=True, nlgeom=True, increments=9,
                      solver="MUMPS",
                      amplitude="STEP")
    step.boundary("N", 1, 0.5, amplitude="AMP", delay=0.25, fixed=True, op="NEW")
    step.load([2, "N"], 2, 0.5, amplitude="AMP", delay=0.25, op="MOD")
    step.pressure("E", 1, 0.5, amplitude="AMP", delay=0.25, op="NEW").gravity(0, 9.81, (0.0, -1.0))
    step.surface_pressure("S1", 0.5, amplitude="AMP", delay=0.25, op="MOD")
    step.constraint_method("<method>")
    step.constraint_method("AUGMENTED LAGRANGE", stiffness=1e3, tolerance=1e-6)
    step.constraint_method("PENALTY", factor=2)
    step.contact_initiation("PERSISTENT", gap_tolerance=0.1)
    step.contact_interference(amplitude="AMP")
    step.contact_controls(stabilize=True).contact_controls(stabilize=False)
    step.model_change(("S1", "S2"), add=False).model_change(("S1", "S2"), add=True)
    step.change_friction("I", 0.5).change_friction("I", "rough").change_friction("I")
    step.mortar(integration="SEGMENTS", points=3, multiplier="DUAL", normal="EDGE",
                feature_angle=40.0)
    step.smoothing("HERMITE", feature_angle=30.0)
    step.newton(tolerance=1e-9, maximum=30, polish=True)
    step.time_integration("GENERALIZED ALPHA", alpha=-0.1)
    step.time_integration("GENERALIZED ALPHA", spectral_radius=0.5)
    step.time_integration("ENERGY DECAYING", dissipation=0.5)
    step.time_integration(tolerance=1e-3).events("NODE", fraction=0.01).events(off=True)
    for request in ("NODE FILE", "EL FILE", "CONTACT FILE", "NODE PRINT", "EL PRINT",
                    "CONTACT PRINT", "ENERGY PRINT"):
        group = {"N": "N", "E": "E"}.get(request[0]) if "ENERGY" not in request else None
        step.output(request, ["U", "V"], set=group, frequency=2, time_points="T1",
                    totals="YES" if "PRINT" in request and "ENERGY" not in request else None)
    step.remove_equations(("N", 1)).remove_equations()
    step.output("NODE PRINT", ["U"], set="N", global_axes=True)
    step.output("SECTION PRINT", ["SOF"], set="S", frequency=2, time_points="T1", name="CUT")
    step.restart(5)
    model.step("STATIC", nlgeom=False, direct=True, solver="UMFPACK", stabilize=1e-3)
    model.step("DYNAMIC", 0.001, 1.0, explicit=True)
    return model


def registry() -> dict[str, set[str]]:
    """Keywords and parameters that the reader supports, blanks left out."""
    source = re.sub(r'" *& *\n *// *"', "", KEYWORDS.read_text())
    for name in ("printed", "filed"):
        (value,) = re.findall(rf'{name} = "([^"]*)"', source)
        source = source.replace(f'" // {name}', f'{value}"').replace(f" {name})", f' "{value}")')
    known: dict[str, set[str]] = {}
    source = re.sub(r",\s*&?\s*has_data=\.false\.", "", source)
    for name, rest in re.findall(r'keyword_t\("([^"]+)", in_\w+(.*)\)', source):
        options, _, reason = rest.removeprefix(", ").partition(", ")
        if not reason:
            known[name.replace(" ", "")] = {
                word.rstrip("=?") for word in options.strip('"').split(",")
                if word and word[0] not in "!~"}
    return known


def test_all_keywords_of_the_reader_have_a_method() -> None:
    written: dict[str, set[str]] = {}
    for line in everything().deck().splitlines():
        if line.startswith("*"):
            name, *options = line[1:].replace(" ", "").split(",")
            written.setdefault(name, set()).update(o.split("=")[0] for o in options)
    known = registry()
    assert len(known) > 40 and known["NODE"] == {"NSET"} and "INC" in known["STEP"]
    assert known["ELPRINT"] == {"ELSET", "FREQUENCY", "TIMEPOINTS", "TOTALS"}
    del known["NOANALYSIS"]                      # Model.stepper checks without it
    del known["PREPRINT"]                        # does nothing; Model.cards takes it
    del known["USERELEMENT"]                     # its shape comes from Fortran; Model.cards too
    known["SURFACEBEHAVIOR"].remove("DIRECT")    # says of hard contact what holds without it
    known["CONTACTPAIR"].remove("TIED")          # Model.tie says it
    for name in ("OUTPUT", "NODEOUTPUT", "ELEMENTOUTPUT", "CONTACTOUTPUT", "ENERGYOUTPUT"):
        del known[name]                          # the requests of `output` in other words
    for name in ("PART", "ENDPART", "ASSEMBLY", "ENDASSEMBLY", "INSTANCE", "ENDINSTANCE"):
        del known[name]                          # a model by calls is one of all its bodies
    for name, word in (("NSET", "INTERNAL"), ("ELSET", "INTERNAL"), ("SURFACE", "INTERNAL"),
                       ("STEP", "NAME")):
        known[name].remove(word)                 # labels that another program shows
    for name, word in (("CONTACTINTERFERENCE", "TYPE"), ("DYNAMIC", "APPLICATION"),
                       ("CONTACTPRINT", "MASTER"), ("CONTACTPRINT", "SLAVE"),
                           ("RIGIDBODY", "ROTNODE")):
        known[name].remove(word)                 # what holds without them, in others' words
    missing = {name: options - written.get(name, set()) for name, options in known.items()
               if name not in written or not options <= written[name]}
    assert not missing
    assert len(LAWS) >= 8
    assert all(law.keyword in written and (not law.variant or law.variant in written[law.keyword])
               for law in LAWS.values())


@pytest.mark.parametrize("path", sorted((ROOT/"input_decks").glob("*.inp"))
                         + sorted((ROOT/"tests"/"decks").glob("good_*.inp")), ids=lambda p: p.stem)
def test_keywords_of_every_deck_have_a_method(path: Path) -> None:
    known = registry() | {"ENDSTEP": set()}
    names = {line.strip()[1:].split(",")[0].replace(" ", "").replace("\t", "").upper()
             for line in path.read_text().splitlines() if re.match(r"\s*\*[^*]", line)}
    unknown = names - set(known)
    assert not unknown or path.stem in (
        "good_lenient", "good_exporters", "good_parts", "good_freecad_contact",
        "good_prepomax_contact", "good_abaqus_contact")


def test_restitution_of_friction_goes_with_friction() -> None:
    with pytest.raises(errors.InputError, match="give friction too"):
        Model().interaction("I", friction_restitution=0.5)


def test_a_part_of_damping_goes_with_damping() -> None:
    with pytest.raises(errors.InputError, match="give damping too"):
        Model().interaction("I", tangent_fraction=0.5)


# --- messages ----------------------------------------------------------------------------------

SCRIPT = """
import sys
sys.path.insert(0, {pywrap!r})
from emcon.model import Model
model = Model.from_arrays([[0, 0], [1, 0], [1, 1], [0, 1]],
                          [[0, 1, 2, 3]])
model.material("M",
               elastic=(-3, 0.3))
model.section("M", thickness=-1.0)
model.cards('''
    *NSET, NSET=LEFT
    1, 44
''')
step = model.step("STATIC")
step.load("TOP", 1, 2.0)
model.stepper()
"""


def test_messages_name_the_line_of_python(tmp_path: Path) -> None:
    script = tmp_path/"study.py"
    script.write_text(SCRIPT.format(pywrap=str(ROOT/"pywrap")))
    done = subprocess.run([sys.executable, "study.py"], cwd=tmp_path, capture_output=True,
                          text=True, check=False)
    assert done.returncode == 1 and "InputError" in done.stderr
    for line, text in ((7, "ELASTIC.*-3"), (9, "SOLID SECTION"), (10, "NSET.*44"),
                       (15, "CLOAD.*TOP")):
        assert re.search(rf"study\.py:{line}: error: \*?.*{text}", done.stderr), done.stderr


def test_messages_about_included_decks_name_their_lines(tmp_path: Path) -> None:
    (tmp_path/"bad.inp").write_text("*NODE\n1, 0., 0.\n*ELEMNT, TYPE=CPE4\n")
    with pytest.raises(InputError, match=r"(?s)bad\.inp:3: .*ELEMENT"):
        Model.from_deck(tmp_path/"bad.inp").stepper()
    with pytest.raises(InputError, match=r"test_model\.py:\d+: error: .*no such file"):
        Model.from_deck(tmp_path/"none, none .inp").stepper()
    with pytest.raises(InputError, match=r"test_model\.py:.*the deck is empty"):
        Model().stepper()
    square().write(tmp_path/"a, b .inp")
    assert np.abs(final(Model.from_deck(tmp_path/"a, b .inp"))).max() > 0.0


def test_many_errors_and_unlucky_text_do_no_harm() -> None:
    model = square()
    for k in range(200):
        model.cards(f"*NSET, NSET=S{k}\nNONE{k}")
    with pytest.raises(InputError, match="more errors"):
        model.stepper()
    with pytest.raises(InputError, match="not a text"):
        Model().cards("*NODE\n1, 0., 0.\0")
    with pytest.raises(InputError, match="END STEP"):
        square().cards("*STEP\n*STATIC").stepper()
    Model("Ünïcode in a heading is fine").cards("** Kommentar: ä").heading("zwei ß")


def test_lines_of_a_text_are_counted_where_that_is_asked_for(tmp_path: Path) -> None:
    """`emcon_read_passages` with those of a text in one file and in two."""
    (tmp_path/"nodes.inp").write_text("*NODE\n1, 0., 0.\n2, 0., nan\n")
    text = f"*INCLUDE, INPUT={tmp_path}/nodes.inp\n*NSET, NSET=A\n1, 7\n*ELSET, ELSET=B\n8\n"

    def message(*places: tuple[int, int, int, int]) -> str:
        ierr, handle = _core.emcon_read_passages(
            text.encode(), np.array(places, dtype=np.int32), b"one\ntwo", b"", 0)
        assert ierr == 2
        found = errors.message(handle)
        _core.emcon_close(handle)
        return found

    counted = message((99, 1, 1, 1))
    assert "one:3: error" in counted and "one:5: error" in counted
    assert "nodes.inp:3: error" in counted
    split = message((2, 1, 30, 0), (0, 1, 9, 1), (2, 2, 50, 0), (1, 1, 60, 0))
    assert "two:50: error" in split and "one:60: error" in split
    assert "a passage belongs to a file from 1 to 2" in message((5, 3, 1, 1))


def test_model_goes_to_other_processes() -> None:
    assert np.array_equal(final(pickle.loads(pickle.dumps(square()))), final(square()))


# --- bad input ---------------------------------------------------------------------------------

@pytest.mark.parametrize(("nodes", "elements", "message"), [
    ([[0, 0, 0]], [[0, 1, 2]], "have a kind"),
    ([[0, 0, 0, 0]], [[0, 1, 2]], r"\(n, 2\) or \(n, 3\) array"),
    ([0, 1], [[0, 1, 2]], r"\(n, 2\) or \(n, 3\) array"),
    ([[0, 0], [1, np.nan], [1, 1]], [[0, 1, 2]], "not finite: nan at"),
    ([[0, 0], [1, np.inf], [1, 1]], [[0, 1, 2]], "not finite: inf"),
    ([["a", "b"]], [[0, 1, 2]], "real numbers are wanted, not text"),
    ([[0, 0], [1j, 0], [1, 1]], [[0, 1, 2]], "real numbers"),
    ([[0, 0], [1], [1, 1]], [[0, 1, 2]], "nodes"),
    (SQUARE, [[0, 1]], r"\(m, 3\) or \(m, 4\)"),
    (SQUARE, [0, 1, 2], r"\(m, 3\) or \(m, 4\)"),
    (SQUARE, [[0.0, 1.0, 2.0]], "whole numbers"),
    (SQUARE, [[0, 1, 4]], "no node 4; rows of nodes are 0 to 3"),
    (SQUARE, [[0, 1, -1]], "no node -1"),
    (SQUARE, {"CPE9": [[0, 1, 2]]}, "no kind"),
    (SQUARE, {"CPE8": [[0, 1, 2]]}, "have 8 nodes"),
    (SQUARE, {"CPE4": [[0, 1, 2]]}, "have 4 nodes"),
])
def test_arrays_that_are_no_mesh_are_refused(nodes: Any, elements: Any, message: str) -> None:
    with pytest.raises(InputError, match=message):
        Model.from_arrays(nodes, elements)


@pytest.mark.parametrize(("labels", "message"), [
    ({"node_labels": [1, 2, 3]}, r"shape \(4\)"),
    ({"node_labels": [0, 1, 2, 3]}, "from 1 to"),
    ({"node_labels": [1, 2, 3, 2**31]}, "from 1 to"),
    ({"node_labels": [1.5, 2.0, 3.0, 4.0]}, "whole"),
    ({"element_labels": {"CPE4": [1]}}, "kinds"),
])
def test_labels_that_cannot_be_are_refused(labels: Any, message: str) -> None:
    with pytest.raises(InputError, match=message):
        square(**labels)


def test_faults_of_the_mesh_are_told_by_the_reader() -> None:
    for nodes, elements, text in ((SQUARE, [[0, 3, 2, 1]], "clockwise"),
                                  (SQUARE, [[0, 1, 1, 2]], "twice"),
                                  (SQUARE*[1, 0], [[0, 1, 2, 3]], "area")):
        model = Model.from_arrays(nodes, elements)
        model.material("M", elastic=(1.0, 0.3)).section("M").step("STATIC")
        with pytest.raises(InputError, match=rf"test_model\.py:\d+: error: .*{text}"):
            model.stepper()
    with pytest.raises(InputError, match="no node"):
        Model.from_arrays(SQUARE[:0], np.zeros((0, 4), int)).stepper()
    with pytest.raises(InputError, match="twice"):
        square(node_labels=[1, 2, 2, 3]).stepper()


@pytest.mark.parametrize("name", [
    "A\n*STEP", "A, B", "", " ", "1A", "*A", "A=B", "'A", '"A"', "Ä", "A\0", "A\tB", "<h",
    "A" + "B"*80, "A\u2028B", 3.5, None, True, "-1", ".5", "<h>, NSET=X"])
def test_names_that_cannot_stand_in_a_deck_are_refused(name: Any) -> None:
    model = Model.from_arrays(SQUARE, [[0, 1, 2, 3]])
    step = model.step("STATIC")
    before = model.deck()
    refused: list[Callable[[], object]] = [
        lambda: model.node_set(name, [0]), lambda: model.element_set(name, [0])]
    if isinstance(name, str):
        refused += [
            lambda: model.node_set("A", [name]), lambda: model.tie("T", name, "B"),
            lambda: model.contact_pair("A", "B", interaction=name), lambda: model.section(name),
            lambda: model.material(name, elastic=(1, 0.3)), lambda: model.interaction(name),
            lambda: model.surface(name, nodes=[0]), lambda: model.add_nodes(SQUARE, name=name),
            lambda: step.constraint_method(name), lambda: step.output("NODE FILE", [name]),
            lambda: step.load(name, 1, 1.0), lambda: step.load(0, 1, name)]
    for call in refused:
        with pytest.raises(InputError):
            call()
    assert model.deck() == before


def test_values_that_cannot_stand_in_a_deck_are_refused() -> None:
    model = square()
    step = model.step("STATIC")
    nan = float("nan")
    calls: list[tuple[Callable[[], object], str]] = [
        (lambda: model.material("X", elastic=(nan, 0.3)), "not finite"),
        (lambda: model.material("X", elastic=(1.0,)), "2 constants"),
        (lambda: model.material("X", elastic=(1, 0), neo_hooke=(1, 0)), "one law"),
        (lambda: model.section("M", thickness=float("inf")), "not finite"),
        (lambda: model.node_set("X", []), "no node"),
        (lambda: model.node_set("X", [7]), "no node 7"),
        (lambda: model.node_set("X", [True, False]), "whole numbers"),
        (lambda: model.node_set("all", [0]), "ALL"),
        (lambda: model.surface("X"), "one of them"),
        (lambda: model.surface("X", nodes=[0], elements=[0]), "one of them"),
        (lambda: model.surface("X", faces=[(0, 7)]), "a face is"),
        (lambda: model.surface("X", faces=[0, 1]), "pairs"),
        (lambda: model.surface("X", faces=np.array([[9, 1]])), "no element 9"),
        (lambda: model.surface("X", edges=[[0, 1, 2]]), "shape"),
        (lambda: model.amplitude("X", [0, 1], [0]), "one length"),
        (lambda: model.time_points("X"), "either"),
        (lambda: model.initial("VELOCITY", [0, 1], 4, 1.0), "degree of freedom"),
        (lambda: model.initial("VELOCITY", [0, 1], True, 1.0), "whole numbers"),
        (lambda: model.initial("VELOCITY", [0, 1], (), 1.0), "degree of freedom"),
        (lambda: model.node_set("X", [[0, 1], [2]]), "node set X"),
        (lambda: model.initial("VELOCITY", [0, 1], 1, [1.0, 2.0, 3.0]), "shape"),
        (lambda: model.equation([(0, 1)]), "a term"),
        (lambda: model.parameter(h="1\n*STEP"), "cannot stand"),
        (lambda: model.parameter(h=nan), "cannot stand"),
        (lambda: model.heading("one\n*STEP"), "star"),
        (lambda: model.include("a\nb"), "name of a deck"),
        (lambda: model.cards("1, 2"), "keyword line"),
        (lambda: model.step("EXPLICIT"), "procedures"),
        (lambda: step.load("A", 1, nan), "not finite"),
        (lambda: step.pressure("A", 7, 1.0), "a face"),
        (lambda: step.gravity("A", 1.0, (0, 1, 0, 0)), "two numbers"),
        (lambda: step.output("NODES", "U"), "output requests"),
        (lambda: step.output("CONTACT PRINT", "CF", set="A"), "whole model"),
        (lambda: Model.from_deck("x.inp", h="1\nk=2"), "cannot stand"),
    ]
    before = model.deck()
    for call, text in calls:
        with pytest.raises(InputError, match=text):
            call()
        assert model.deck() == before           # what is refused leaves nothing behind


def test_model_of_a_deck_is_counted_by_labels(tmp_path: Path) -> None:
    model = Model.from_deck(square().write(tmp_path/"square.inp"))
    with pytest.raises(InputError, match="labels"):
        model.add_nodes(SQUARE)
    with pytest.raises(InputError, match="from 1"):
        model.node_set("X", [0])
    model.step("STATIC").load(77, 1, 1.0)
    with pytest.raises(InputError, match=r"test_model\.py:.*77"):
        model.stepper()


def crushed() -> Model:
    """A block that is pushed through its own floor by the end of the step."""
    model = Model.from_mesh(block(cells=(2, 2)))
    model.material("RUBBER", coupled_neo_hooke=(100.0, 0.3)).section("RUBBER", "BLOCK")
    model.boundary("BLOCK_BOTTOM")
    model.step("STATIC", h=0.25, nlgeom=True).boundary("BLOCK_TOP", 2, -1.5)
    return model


def test_state_after_a_failed_increment_belongs_to_its_time() -> None:
    with crushed().stepper() as stepper:
        with pytest.raises(AnalysisError, match="the analysis stops at time"):
            stepper.run()
        assert 0.5 < stepper.time < 1.0 and stepper.time % 0.25 > 0.0
        # without an amplitude the motion is a linear run: exact but for its rounding
        pushed = stepper.u[stepper.node_set("BLOCK_TOP"), 1]
        assert np.abs(pushed + 1.5*stepper.time).max() <= 8*np.finfo(float).eps*1.5
        with pytest.raises(InputError, match="between two increments"):
            stepper.step()


def test_notes_tell_what_the_deck_reader_doubts() -> None:
    model = Model.from_mesh(block((0.0, 0.0), (2.0, 1.0), (4, 2), "LOWER")
                            + block((0.5, 1.0), (1.0, 1.0), (2, 2), "UPPER"))
    model.material("RUBBER", elastic=(100.0, 0.3), density=1.0)
    model.section("RUBBER", "LOWER").section("RUBBER", "UPPER")
    model.contact_pair("LOWER_TOP", "UPPER_BOTTOM", sides="ONE")
    model.contact_pair("UPPER_LEFT", "LOWER_TOP")
    model.step("DYNAMIC", 0.1, 0.1, nlgeom=True)
    with model.stepper() as stepper:
        assert any("the smaller one should be the slave" in note for note in stepper.notes)
        with pytest.raises(InputError, match="no node set MIDDLE"):
            stepper.node_set("MIDDLE")
    with square().stepper() as stepper:
        assert stepper.notes == []
