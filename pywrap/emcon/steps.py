"""A step of a model: its procedure, conditions, settings and output."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Literal, TypeAlias

from numpy.typing import ArrayLike

from .cards import Cards, Dof, Number, Numbering, Where, card, entry
from .errors import InputError
from .options import words

Op: TypeAlias = Literal["MOD", "NEW"]
#: Requests, and the parameter that names their set.
_REQUESTS = {"NODE FILE": "NSET", "EL FILE": "ELSET", "CONTACT FILE": None, "NODE PRINT": "NSET",
             "EL PRINT": "ELSET", "CONTACT PRINT": None, "SECTION PRINT": "SURFACE",
             "ENERGY PRINT": None}


class Step(Cards):
    """Cards between `*STEP` and `*END STEP`; made by `Model.step`.

    Conditions, settings and output requests stay for later steps until they are given again.
    Methods return the step.
    """

    def __init__(self, numbering: tuple[Numbering, Numbering], step: dict[str, object],
                 procedure: str, options: dict[str, object],
                 times: Sequence[Number | None]) -> None:
        super().__init__(*numbering)
        if procedure not in words("procedure"):
            raise InputError(f"procedures are {' and '.join(words('procedure'))}, not "
                             f"{procedure!r}")
        entries = ", ".join("" if time is None else entry(time, f"*{procedure}") for time in times)
        self._add(card("STEP", step) + card(procedure, options, data=entries.rstrip(", ") + "\n"))

    # --- loads -----------------------------------------------------------------------------

    def load(self, where: Where, dof: Dof, force: Number | ArrayLike, *,
             amplitude: str | None = None, delay: Number | None = None,
             op: Op | None = None) -> Step:
        """`*CLOAD`: forces on nodes [M L/T^2].

        where   node set, node, or (k,) of them
        dof     1, 2, 3 or some of them; in the plane 6: moment on the reference node of a rigid
                body [M L^2/T^2]
        force   one for all, (n_dof,), or (k, n_dof)
        delay   time by which the amplitude is shifted [T]
        op      NEW: remove all forces of earlier steps
        """
        self._valued("CLOAD", where, dof, force,
                     {"OP": op, "AMPLITUDE": amplitude, "TIME DELAY": delay})
        return self

    def pressure(self, where: Where, face: int, value: Number, *, amplitude: str | None = None,
                 delay: Number | None = None, op: Op | None = None) -> Step:
        """`*DLOAD`: pressure [M/(L T^2)], positive inwards, on face 1..4 of elements, in
        space 1..6.

        Loads of one step on the same place add up; those of a later step replace them.

        where   element set, element, or (k,) of them
        op      NEW: remove all pressures and gravity of earlier steps
        """
        if face not in range(1, 7):
            raise InputError(f"a face is 1 to 6, not {face!r}")
        return self._distributed(where, [f"P{int(face)}", value], op, amplitude, delay)

    def surface_pressure(self, surface: str, value: Number, *, amplitude: str | None = None,
                         delay: Number | None = None, op: Op | None = None) -> Step:
        """`*DSLOAD`: pressure [M/(L T^2)], positive inwards, on all faces of a surface.

        op      NEW: remove all pressures on surfaces of earlier steps
        """
        return self._card("DSLOAD", {"OP": op, "AMPLITUDE": amplitude, "TIME DELAY": delay},
                          [(surface, "P", value)])

    def gravity(self, where: Where, g: Number, direction: Sequence[Number] = (0.0, -1.0), *,
                amplitude: str | None = None, delay: Number | None = None,
                op: Op | None = None) -> Step:
        """`*DLOAD`: acceleration `g` [L/T^2] of elements along `direction` (2,) or (3,), of any
        length."""
        if isinstance(direction, str) or len(direction) not in (2, 3):
            raise InputError("the direction of gravity is two numbers, in space three, not "
                             f"{direction!r}")
        return self._distributed(where, ["GRAV", g, *direction], op, amplitude, delay)

    def _distributed(self, where: Where, load: Sequence[object], op: Op | None,
                     amplitude: str | None, delay: Number | None) -> Step:
        names = self._names(where, self._elements, "*DLOAD")
        return self._card("DLOAD", {"OP": op, "AMPLITUDE": amplitude, "TIME DELAY": delay},
                          [(name, *load) for name in names])

    # --- settings --------------------------------------------------------------------------

    def constraint_method(self, type: str, *, stiffness: Number | None = None,
                          factor: Number | None = None, tolerance: Number | None = None) -> Step:
        """`*CONSTRAINT METHOD`: NULL SPACE (default), SADDLE POINT, PENALTY or AUGMENTED LAGRANGE.

        stiffness       of the last two: pressure over penetration [M/(L T)^2]
        factor          or stiffness in terms of that of the elements (1)
        tolerance       of AUGMENTED LAGRANGE: largest remaining gap, in edge lengths (1e-8)
        """
        return self._card("CONSTRAINT METHOD", {"TYPE": type, "STIFFNESS": stiffness,
                                                "FACTOR": factor, "TOLERANCE": tolerance})

    def contact_initiation(self, type: str = "AUTO", *,
                           gap_tolerance: Number | None = None) -> Step:
        """`*CONTACT INITIATION`: AUTO (default), PERSISTENT, ADMISSIBLE, VELOCITY UPDATE, MASSLESS.

        AUTO is MASSLESS on bodies that are many elements across, PERSISTENT elsewhere.

        gap_tolerance   largest new stand-off as a fraction of an edge, for nodes with mass
        """
        return self._card("CONTACT INITIATION", {"TYPE": type, "GAP TOLERANCE": gap_tolerance})

    def contact_interference(self, *, amplitude: str | None = None) -> Step:
        """`*CONTACT INTERFERENCE, SHRINK`: overlaps at the start are pushed apart over the step.

        The step has to be the first one and static.

        amplitude       the fraction of the overlap that remains, from 1 to 0; default linear
        """
        return self._card("CONTACT INTERFERENCE", {"SHRINK": True, "AMPLITUDE": amplitude})

    def contact_controls(self, *, stabilize: bool) -> Step:
        """`*CONTACT CONTROLS`: STABILIZE, or RESET to the default, for static steps.

        With STABILIZE a motion without support and without load is as small as possible.
        """
        return self._card("CONTACT CONTROLS", {"STABILIZE": True} if stabilize else {"RESET": True})

    def model_change(self, *pairs: tuple[str, str], add: bool) -> Step:
        """`*MODEL CHANGE`: contact pairs act from this step on, or do not, until another change.

        pairs           slave and master surface of each
        add             True: they act; False: they do not
        """
        return self._card("MODEL CHANGE", {"TYPE": "CONTACT PAIR", "ADD": add, "REMOVE": not add},
                          pairs)

    def change_friction(self, interaction: str,
                        friction: Number | Literal["ROUGH"] | None = None) -> Step:
        """`*CHANGE FRICTION`: from the start of this step on, until another change.

        friction        coefficient, 0 or more, or "ROUGH"; None: that of the model again
        """
        text = card("CHANGE FRICTION", {"INTERACTION": interaction, "RESET": friction is None})
        if friction is not None:
            is_rough = isinstance(friction, str) and friction.upper() == "ROUGH"
            text += card("FRICTION", {"ROUGH": is_rough}, rows=[] if is_rough else [(friction,)])
        self._add(text)
        return self

    def mortar(self, *, integration: str | None = None, points: int | str | None = None,
               multiplier: str | None = None, normal: str | None = None,
               feature_angle: Number | None = None) -> Step:
        """`*MORTAR`, for pairs of type MORTAR and SEGMENT; other options stay as they are.

        integration     SEGMENTS (default) or ELEMENTS
        points          Gauss points: 2 to 10 per segment, or 1 to 10 per slave edge
        multiplier      DUAL (default) or STANDARD
        normal          NODAL (default) or EDGE
        feature_angle   degrees; a sharper turn is a corner
        """
        return self._card("MORTAR", {"INTEGRATION": integration, "POINTS": points,
                                     "MULTIPLIER": multiplier, "NORMAL": normal,
                                     "FEATURE ANGLE": feature_angle})

    def smoothing(self, type: str, *, feature_angle: Number | None = None) -> Step:
        """`*SURFACE SMOOTHING` of master surfaces: NONE (default) or HERMITE.

        feature_angle   degrees; a sharper turn is a corner
        """
        return self._card("SURFACE SMOOTHING", {"TYPE": type, "FEATURE ANGLE": feature_angle})

    def newton(self, type: str = "KEPT", *, tolerance: Number | None = None,
               maximum: int | str | None = None, polish: bool | None = None) -> Step:
        """`*NEWTON`: KEPT (default), a factor over many increments of dynamics, or FULL.

        tolerance       relative residual, below 1 (default 1e-10)
        maximum         largest number of tangents in a step (20); corrections of KEPT: twice it
        polish          False: no corrections below the tolerance
        """
        ends = None if polish is None else "YES" if polish else "NO"
        return self._card("NEWTON", {"TYPE": type, "TOLERANCE": tolerance, "MAXIMUM": maximum,
                                     "POLISH": ends})

    def time_integration(self, scheme: str | None = None, *, alpha: Number | None = None,
                         spectral_radius: Number | None = None,
                         dissipation: Number | None = None,
                         tolerance: Number | None = None) -> Step:
        """`*TIME INTEGRATION`: ENERGY MOMENTUM (default), another scheme, or one that a program gives.

        scheme            MIDPOINT, TRAPEZOIDAL, GENERALIZED ALPHA, BDF2, ENERGY DECAYING; CENTRAL
                          DIFFERENCE, in explicit steps
        alpha             of GENERALIZED ALPHA, -1/3 to 0 (default -0.05)
        spectral_radius   of GENERALIZED ALPHA, instead: at the highest frequencies, 0 to 1
        dissipation       of ENERGY DECAYING, 0 to 1 (0.125)
        tolerance         increments follow the error of the motion, relative to its path (1e-2
                          coarse, 1e-4 fine); not in steps that are `direct`
        """
        return self._card("TIME INTEGRATION", {"SCHEME": scheme, "ALPHA": alpha,
                                               "SPECTRAL RADIUS": spectral_radius,
                                               "DISSIPATION": dissipation,
                                               "TOLERANCE": tolerance})

    def events(self, type: str | None = None, *, fraction: Number | None = None,
               off: bool = False) -> Step:
        """`*EVENTS`: contact begins and ends within short increments, which the log lists.

        type            PAIR (default): a pair meets or parts; NODE: each slave node
        fraction        of the increment of the step, 1e-6 to 1 (default 1e-3)
        off             end the search for events that an earlier step began
        """
        return self._card("EVENTS", {"TYPE": type, "FRACTION": fraction, "OFF": off or None})

    def remove_equations(self, *dofs: tuple[str | int, int]) -> Step:
        """`*EQUATION, REMOVE`: those whose first term is a node (or set) and 1 to 3; all if none."""
        if not dofs:
            return self._card("EQUATION", {"REMOVE ALL": True})
        rows = [(*self._names(where, self._nodes, "*EQUATION"), dof) for where, dof in dofs]
        return self._card("EQUATION", {"REMOVE": True}, rows)

    # --- output ----------------------------------------------------------------------------

    def output(self, request: str, variables: str | Sequence[str] = (), *,
               set: str | None = None, frequency: int | str | None = None,
               time_points: str | None = None, totals: str | None = None,
               name: str | None = None, global_axes: bool | None = None) -> Step:
        """Ask for output of the batch program, `emcon run`.

        request       NODE, EL or CONTACT with FILE (fields) or PRINT (history); SECTION PRINT;
                      ENERGY PRINT
        variables     U, V, RF, UR, VR, RM; S, E, ENER, ELSE, ELKE, EVOL; CDIS, CSTR, CF, CSHEAR,
                      CSLIP, CNAREA, CNUM; SOF, SOM, SOMC, SOCENTER, SOAREA
        set           of nodes or elements, for NODE and EL; the surface of SECTION PRINT
        frequency     number of increments between outputs; 0: none
        time_points   name of time points, in place of `frequency`
        totals        YES or ONLY: the sums over the set, for PRINT
        name          of a section in the history; default: that of its surface
        global_axes   NODE PRINT: along the axes of the model, not those of `Model.transform`
        """
        if request not in _REQUESTS:
            raise InputError(f"output requests are {', '.join(_REQUESTS)}, not {request!r}")
        key = _REQUESTS[request]
        if set is not None and key is None:
            raise InputError(f"{request} is for the whole model, not for a set")
        chosen = [variables] if isinstance(variables, str) else list(variables)
        return self._card(request, {**({key: set} if key else {}), "FREQUENCY": frequency,
                                    "TIME POINTS": time_points, "TOTALS": totals, "NAME": name,
                                    "GLOBAL": None if global_axes is None
                                    else "YES" if global_axes else "NO"},
                          [chosen] if chosen else [])

    def restart(self, frequency: int | str | None = None) -> Step:
        """`*RESTART, WRITE`: `emcon run` writes a restart file every `frequency` increments; 0: none."""
        return self._card("RESTART", {"WRITE": True, "FREQUENCY": frequency})
