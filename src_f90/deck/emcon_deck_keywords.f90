!> The keyword registry: what the deck language knows. One row per keyword.
module emcon_deck_keywords
   use emcon_diagnostics, only : entries
   use emcon_kinds, only : wp
   use emcon_law_registry, only : law_titles
   use emcon_text, only : read_real, squeezed, string_t
   implicit none
   private
   public :: keyword_t, keywords, find_keyword, keyword_names, refusal_of, refusal_t, refusals
   public :: parameter_mark, parameter_names, parameter_reason, is_neutral
   public :: in_model, in_step, in_both, gap_instead
   public :: mark_none, mark_flag, mark_value, mark_either, mark_unsupported, mark_without_effect

   !> Where a keyword may stand: before the first *STEP, inside a step, or anywhere.
   integer, parameter :: in_model = 1, in_step = 2, in_both = 3

   !> How a keyword takes a parameter: not at all, without value, with value, either way; known
   !> but not supported; or taken but, as a warning says, without effect.
   integer, parameter :: mark_none = 0, mark_flag = 1, mark_value = 2, mark_either = 3, &
      mark_unsupported = 4, mark_without_effect = 5

   !> One keyword. `parameters` lists them with commas, without blanks inside: `NAME=` takes a
   !> value, `NAME` none, `NAME?` may; `!NAME` is known but not supported, `~NAME` has no effect;
   !> `!NAME:VALUE` and `~NAME:VALUE` are accepted with the value that changes nothing.
   type :: keyword_t
      character(len=27) :: name = ""
      integer :: place = in_both
      character(len=256) :: parameters = ""
      logical :: has_data = .true.           !! data lines may follow
   end type keyword_t

   !> Keywords of other programs that are known, and why they do nothing here.
   type :: refusal_t
      character(len=100) :: reason = ""
      character(len=240) :: names = ""       !! with commas between them
      logical :: is_output = .false.         !! --lenient reads on
      logical :: is_idle = .false.           !! taken: they would change nothing
   end type refusal_t

   !> What to do without elements that hold the distance of two nodes.
   character(len=*), parameter :: gap_instead = "use *CONTACT PAIR with a *SURFACE, TYPE=NODE " &
      // "as slave, as far from its master as the gap is wide"

   character(len=*), parameter :: printed = "FREQUENCY=,TIMEPOINTS=,TOTALS="
   character(len=*), parameter :: filed = "FREQUENCY=,TIMEPOINTS=,~GLOBAL:YES,~OUTPUT:2D," &
      // "~POSITION,~CONTACTELEMENTS,!USER"

   type(keyword_t), parameter :: keywords(*) = [ &
      keyword_t("HEADING", in_both), &
      keyword_t("PREPRINT", in_both, "~ECHO:NO,~MODEL:NO,~HISTORY:NO,~CONTACT:NO", &
         has_data=.false.), &
      keyword_t("PARAMETER", in_both), &
      keyword_t("INCLUDE", in_both, "INPUT="), &
      keyword_t("PART", in_model, "NAME=", has_data=.false.), &
      keyword_t("END PART", in_model, has_data=.false.), &
      keyword_t("ASSEMBLY", in_model, "NAME=", has_data=.false.), &
      keyword_t("END ASSEMBLY", in_model, has_data=.false.), &
      keyword_t("INSTANCE", in_model, "NAME=,PART=,!LIBRARY"), &
      keyword_t("END INSTANCE", in_model, has_data=.false.), &
      keyword_t("NODE", in_model, "NSET=,!SYSTEM:R,!INPUT"), &
      keyword_t("ELEMENT", in_model, "TYPE=,ELSET=,!INPUT,!OFFSET:0"), &
      keyword_t("USER ELEMENT", in_model, "TYPE=,NODES=,FACES=,COORDINATES=,!PROPERTIES:0," &
         // "!IPROPERTIES:0,!VARIABLES:1,~UNSYMM,!LINEAR,!TENSOR,!INTEGRATION,!FILE"), &
      keyword_t("NSET", in_both, "NSET=,GENERATE,ELSET=,INTERNAL,~UNSORTED,!INSTANCE"), &
      keyword_t("ELSET", in_both, "ELSET=,GENERATE,INTERNAL,~UNSORTED,!INSTANCE"), &
      keyword_t("SURFACE", in_model, "NAME=,TYPE=,INPUT=,SCALE=,FILLETRADIUS=,INTERNAL," &
         // "!COMBINE,!CROP,!TRIM"), &
      keyword_t("GIVEN FORCES", in_model, "NSET=", has_data=.false.), &
      keyword_t("SOLID SECTION", in_model, "ELSET=,MATERIAL=,KINEMATICS=,MASSLESS," &
         // "ORIENTATION=,!OFFSET:0,~CONTROLS"), &
      keyword_t("ORIENTATION", in_model, "NAME=,SYSTEM=,~DEFINITION:COORDINATES"), &
      keyword_t("RIGID BODY", in_model, "ELSET=,NSET=,ANALYTICALSURFACE=,REFNODE=,ROTNODE=," &
         // "!PINNSET,!TIENSET,!POSITION:INPUT,!ISOTHERMAL:NO", has_data=.false.), &
      keyword_t("MATERIAL", in_model, "NAME=", has_data=.false.), &
      keyword_t("DENSITY", in_model, "!DEPENDENCIES:0"), &
      keyword_t("DAMPING", in_model, "ALPHA=,BETA=,!COMPOSITE,!STRUCTURAL:0", has_data=.false.), &
      keyword_t("ELASTIC", in_model, "TYPE=,~MODULI,!DEPENDENCIES:0"), &
      keyword_t("HYPERELASTIC", in_model, "N=,!POLYNOMIAL,!REDUCEDPOLYNOMIAL," &
         // "!ARRUDA-BOYCE,!VANDERWAALS,!MARLOW,~MODULI,!DEPENDENCIES:0"), &
      keyword_t("USER MATERIAL", in_model, "CONSTANTS=,~UNSYMM,!TYPE:MECHANICAL," &
         // "!HYBRIDFORMULATION"), &
      keyword_t("INITIAL CONDITIONS", in_model, "TYPE=,!USER"), &
      keyword_t("AMPLITUDE", in_both, "NAME=,TIME=,DEFINITION=,!USER,!VALUE:RELATIVE,!SMOOTH:0"), &
      keyword_t("TIME POINTS", in_both, "NAME=,GENERATE"), &
      keyword_t("SURFACE INTERACTION", in_model, "NAME=,PADTHICKNESS=,RESTITUTION="), &
      keyword_t("SURFACE BEHAVIOR", in_model, "PRESSURE-OVERCLOSURE=,DIRECT,!NOSEPARATION," &
         // "~PENALTY,~AUGMENTEDLAGRANGE"), &
      keyword_t("FRICTION", in_both, "RESTITUTION=,ROUGH,~SLIPTOLERANCE,~ELASTICSLIP," &
         // "~LAGRANGE,!TAUMAX,!SHEARTRACTIONSLOPE,!EXPONENTIALDECAY,!TESTDATA,!ANISOTROPIC," &
         // "!USER,!DEPVAR:0,!PROPERTIES:0,!DEPENDENCIES:0"), &
      keyword_t("CONTACT DAMPING", in_model, "DEFINITION=,TANGENTFRACTION="), &
      keyword_t("CONTACT PAIR", in_model, "INTERACTION=,TYPE=,SIDES=,GUARD=,EDGES=," &
         // "ADJUST=,INITIATION=,TIED,~SMALLSLIDING,~NOTHICKNESS,~SMOOTH," &
         // "~MECHANICALCONSTRAINT:KINEMATIC,~CPSET,~WEIGHT,~TRACKING,~GEOMETRICCORRECTION," &
         // "~SUPPLEMENTARYCONSTRAINTS,~HCRIT,~EXTENSIONZONE,~OP:NEW"), &
      keyword_t("CLEARANCE", in_model, "MASTER=,SLAVE=,VALUE=,!TABULAR,!BOLT,!CPSET," &
         // "!SEARCHNSET", has_data=.false.), &
      keyword_t("CONTACT", in_model, "~OP:NEW", has_data=.false.), &
      keyword_t("CONTACT INCLUSIONS", in_model, "ALLEXTERIOR,TYPE="), &
      keyword_t("CONTACT PROPERTY ASSIGNMENT", in_model), &
      keyword_t("TIE", in_model, "NAME=,POSITIONTOLERANCE=,MULTIPLIER=,ADJUST=,TYPE=," &
         // "CYCLICSYMMETRY?,TRANSLATION,REFNODE=,~NOROTATION,~NOTHICKNESS,!MULTISTAGE," &
         // "!TIEDNSET,!CONSTRAINTRATIO"), &
      keyword_t("CYCLIC SYMMETRY MODEL", in_model, "N=,TIE=,~NGRAPH,~ELSET,!CHECK:YES," &
         // "!CONTACT,!MATRIX"), &
      keyword_t("EQUATION", in_both, "REMOVE,REMOVEALL,!INPUT"), &
      keyword_t("TRANSFORM", in_model, "NSET=,TYPE="), &
      keyword_t("CONTACT INTERFERENCE", in_step, "SHRINK,AMPLITUDE=,TYPE=,~OP:NEW"), &
      keyword_t("MODEL CHANGE", in_step, "TYPE=,ADD,REMOVE,~ACTIVATE"), &
      keyword_t("CHANGE FRICTION", in_step, "INTERACTION=,RESET,!AMPLITUDE,!ELEMENTSET," &
         // "!NODESET", has_data=.false.), &
      keyword_t("CONTACT CONTROLS", in_step, "STABILIZE?,RESET,~MASTER,~SLAVE," &
         // "~ABSOLUTEPENETRATIONTOLERANCE,~RELATIVEPENETRATIONTOLERANCE," &
         // "!AUTOMATICTOLERANCES,!FRICTIONONSET,!LAGRANGEMULTIPLIER,!MAXCHP,!PERRMX,!UERRMX," &
         // "!STIFFNESSSCALEFACTOR,!TANGENTFRACTION:1", has_data=.false.), &
      keyword_t("BOUNDARY", in_both, "OP=,AMPLITUDE=,FIXED,TYPE=,TIMEDELAY=,!LOADCASE:1," &
         // "!USER,!SUBMODEL"), &
      keyword_t("STEP", in_both, "NLGEOM?,INC=,AMPLITUDE=,NAME=,~UNSYMM:NO," &
         // "~EXTRAPOLATION,~CONVERTSDI,!PERTURBATION"), &
      keyword_t("STATIC", in_step, "DIRECT,SOLVER=,STABILIZE?,!FACTOR,~ALLSDTOL," &
         // "!CONTINUE:NO,!RIKS,!EXPLICIT"), &
      keyword_t("DYNAMIC", in_step, "DIRECT,EXPLICIT?,SOLVER=,APPLICATION=,!ALPHA:0," &
         // "!INITIAL:NO,!RELATIVETOABSOLUTE,~DIRECTUSERCONTROL,~NOHAF,~HAFTOL," &
         // "~HALFINCSCALEFACTOR"), &
      keyword_t("NO ANALYSIS", in_step, has_data=.false.), &
      keyword_t("CLOAD", in_step, "OP=,AMPLITUDE=,TIMEDELAY=,!LOADCASE:1,!USER,!FOLLOWER," &
         // "!SECTOR"), &
      keyword_t("DLOAD", in_step, "OP=,AMPLITUDE=,TIMEDELAY=,!LOADCASE:1,!USER"), &
      keyword_t("DSLOAD", in_step, "OP=,AMPLITUDE=,TIMEDELAY=,!LOADCASE:1,!USER,!SUBMODEL," &
         // "!FOLLOWER,!ORIENTATION,!CONSTANTRESULTANT"), &
      keyword_t("CONSTRAINT METHOD", in_step, "TYPE=,STIFFNESS=,FACTOR=,TOLERANCE=", &
         has_data=.false.), &
      keyword_t("CONTACT INITIATION", in_step, "TYPE=,GAPTOLERANCE=", has_data=.false.), &
      keyword_t("MORTAR", in_step, "INTEGRATION=,POINTS=,MULTIPLIER=,NORMAL=,FEATUREANGLE=", &
         has_data=.false.), &
      keyword_t("SURFACE SMOOTHING", in_step, "TYPE=,FEATUREANGLE=", has_data=.false.), &
      keyword_t("NEWTON", in_step, "TYPE=,TOLERANCE=,MAXIMUM=,POLISH=", has_data=.false.), &
      keyword_t("TIME INTEGRATION", in_step, "SCHEME=,ALPHA=,SPECTRALRADIUS=," &
         // "DISSIPATION=,TOLERANCE=", has_data=.false.), &
      keyword_t("EVENTS", in_step, "TYPE=,FRACTION=,OFF", has_data=.false.), &
      keyword_t("NODE FILE", in_step, "NSET=," // filed), &
      keyword_t("EL FILE", in_step, "ELSET=,~NSET," // filed), &
      keyword_t("CONTACT FILE", in_step, "~NSET," // filed), &
      keyword_t("NODE PRINT", in_step, "NSET=,GLOBAL=," // printed), &
      keyword_t("EL PRINT", in_step, "ELSET=,~GLOBAL:YES," // printed), &
      keyword_t("CONTACT PRINT", in_step, "MASTER=,SLAVE=,~NSET,~SET,~GLOBAL:YES," // printed), &
      keyword_t("SECTION PRINT", in_step, "SURFACE=,NAME=,FREQUENCY=,TIMEPOINTS=," &
         // "~AXES:GLOBAL,~UPDATE:YES,~FREQUENCYF:1"), &
      keyword_t("ENERGY PRINT", in_step, "~ELSET,~FREQUENCY:1,~TIMEPOINTS"), &
      keyword_t("OUTPUT", in_step, "FIELD,HISTORY,VARIABLE=,FREQUENCY=,TIMEPOINTS=,~NAME," &
         // "~FREQUENCYF:1,~TIMEINTERVAL,~NUMBERINTERVAL,~TIMEMARKS,~OP:NEW,~FILTER", &
         has_data=.false.), &
      keyword_t("NODE OUTPUT", in_step, "NSET=,VARIABLE=,~EXTERIOR"), &
      keyword_t("ELEMENT OUTPUT", in_step, "ELSET=,VARIABLE=,~DIRECTIONS:YES,~POSITION," &
         // "~EXTERIOR"), &
      keyword_t("CONTACT OUTPUT", in_step, "VARIABLE=,~NSET,~MASTER,~SLAVE,~SURFACE," &
         // "~GENERALCONTACT"), &
      keyword_t("ENERGY OUTPUT", in_step, "VARIABLE=,~ELSET"), &
      keyword_t("RESTART", in_both, "WRITE,FREQUENCY=,~OVERLAY,~NUMBERINTERVAL," &
         // "~TIMEMARKS,!READ", has_data=.false.), &
      keyword_t("END STEP", in_step, has_data=.false.)]

   !> Keywords of other programs that are known but not supported, and those that change nothing.
   type(refusal_t), parameter :: refusals(*) = [ &
      refusal_t("write what it couples as *EQUATION; what moves as a whole is a *RIGID BODY", &
         "MPC"), &
      refusal_t("make the coupled nodes a *RIGID BODY by NSET=, or write *EQUATION", &
         "COUPLING,KINEMATIC"), &
      refusal_t("spread the force over the nodes by *CLOAD, over faces by *DSLOAD", &
         "DISTRIBUTING"), &
      refusal_t("give the parts common nodes, or join their surfaces by *TIE", &
         "EMBEDDED ELEMENT"), &
      refusal_t("use *RIGID BODY and TYPE=SEGMENTS", "RIGID SURFACE"), &
      refusal_t("coordinates are those of the global axes", "SYSTEM"), &
      refusal_t("nodes are given one by one by *NODE", "NGEN,NCOPY,NFILL"), &
      refusal_t("elements are given one by one by *ELEMENT", "ELGEN,ELCOPY"), &
      refusal_t("materials are elastic; leave it out where stresses stay below the yield stress", &
         "PLASTIC,CYCLIC HARDENING,DEFORMATION PLASTICITY,MOHR COULOMB,DRUCKER PRAGER," &
         // "CHANGE PLASTIC"), &
      refusal_t("materials are elastic, without damage", "DAMAGE INITIATION,DAMAGE EVOLUTION"), &
      refusal_t("materials are elastic; take the moduli of the time that is of interest", &
         "CREEP,VISCOELASTIC"), &
      refusal_t("use *HYPERELASTIC, NEO HOOKE", "HYPERFOAM"), &
      refusal_t("materials have no state variables", "DEPVAR"), &
      refusal_t("there is no temperature; move surfaces by *CONTACT INTERFERENCE or *BOUNDARY", &
         "TEMPERATURE"), &
      refusal_t("there is no temperature; the procedures are *STATIC and *DYNAMIC", &
         "DFLUX,CFLUX,FILM,RADIATE,HEAT TRANSFER,COUPLED TEMPERATURE-DISPLACEMENT," &
         // "UNCOUPLED TEMPERATURE-DISPLACEMENT"), &
      refusal_t("there is no temperature", &
         "EXPANSION,CONDUCTIVITY,SPECIFIC HEAT,PHYSICAL CONSTANTS,GAP CONDUCTANCE," &
         // "GAP HEAT GENERATION", is_idle=.true.), &
      refusal_t("elements have no artificial stiffness", "SECTION CONTROLS,HOURGLASS STIFFNESS", &
         is_idle=.true.), &
      refusal_t("use *SOLID SECTION", "UEL PROPERTY"), &
      refusal_t("mesh the thickness with solid elements, such as C3D8I or C3D20R", &
         "SHELL SECTION,SHELL GENERAL SECTION,MEMBRANE SECTION,SURFACE SECTION,NODAL " &
         // "THICKNESS,NORMAL"), &
      refusal_t("mesh the cross section with solid elements, such as C3D8I or C3D20R", &
         "BEAM SECTION,BEAM GENERAL SECTION"), &
      refusal_t("use *CONTACT PAIR or *TIE", "COHESIVE SECTION"), &
      refusal_t("use *EQUATION or *RIGID BODY", "CONNECTOR SECTION"), &
      refusal_t("use a strip of soft solid elements, or a program that gives a potential", &
         "SPRING"), &
      refusal_t("damp the material by *DAMPING, or contact by *CONTACT DAMPING", "DASHPOT"), &
      refusal_t("give this mass to solid elements by their *DENSITY", "MASS,ROTARY INERTIA"), &
      refusal_t(gap_instead, "GAP"), &
      refusal_t("list what touches by *CONTACT INCLUSIONS", "CONTACT EXCLUSIONS"), &
      refusal_t("use TYPE of *CONTACT INCLUSIONS", "CONTACT FORMULATION"), &
      refusal_t("use *CLEARANCE, or ADJUST of *CONTACT PAIR", "CONTACT INITIALIZATION DATA," &
         // "CONTACT INITIALIZATION ASSIGNMENT"), &
      refusal_t("use *CONTACT CONTROLS, STABILIZE", "CONTACT STABILIZATION,CONTACT CONTROLS " &
         // "ASSIGNMENT"), &
      refusal_t("faces of solids have no thickness", "SURFACE PROPERTY ASSIGNMENT", &
         is_idle=.true.), &
      refusal_t("damping comes from *DAMPING only", "BULK VISCOSITY", is_idle=.true.), &
      refusal_t("pairs and materials do not change; *MODEL CHANGE removes or adds pairs", &
         "CHANGE CONTACT TYPE,CHANGE SURFACE BEHAVIOR,CHANGE MATERIAL"), &
      refusal_t("prescribe displacements by *BOUNDARY", "PRE-TENSION SECTION"), &
      refusal_t("all sectors of a model deform alike", "SELECT CYCLIC SYMMETRY MODES"), &
      refusal_t("move the nodes in *NODE", "IMPERFECTION"), &
      refusal_t("use *BOUNDARY with an amplitude", "BASE MOTION"), &
      refusal_t("*NEWTON and the procedure say how steps are solved", "CONTROLS", &
         is_idle=.true.), &
      refusal_t("let the body swing in a *DYNAMIC step, and read frequencies off its history", &
         "FREQUENCY,COMPLEX FREQUENCY,MODAL DYNAMIC,STEADY STATE DYNAMICS"), &
      refusal_t("load beyond the limit in a step with NLGEOM, *DYNAMIC or *STATIC, STABILIZE", &
         "BUCKLE"), &
      refusal_t("the procedures are *STATIC and *DYNAMIC", &
         "VISCO,GREEN,SENSITIVITY,SUBSTRUCTURE GENERATE,ELECTROMAGNETICS,CFD"), &
      refusal_t("request results by *NODE FILE, *EL FILE and *... PRINT", &
         "SECTION FILE,INTEGRATED OUTPUT,INTEGRATED OUTPUT SECTION", .true.), &
      refusal_t("it names no results", "FILE FORMAT,MONITOR,INCREMENTATION OUTPUT,FILTER,PRINT", &
         is_idle=.true.), &
      refusal_t("use *EL FILE", "ELEMENT FILE", .true.), &
      refusal_t("the log has diagnostics", "DIAGNOSTICS", is_idle=.true.)]

contains

   !> Index in `keywords` of `name` (upper case, without blanks); 0: it is not supported.
   pure integer function find_keyword(name) result(i)
      character(len=*), intent(in) :: name

      do i = size(keywords), 1, -1
         if (squeezed(keywords(i)%name) == name) return
      end do
   end function find_keyword

   !> Why `name` (upper case, without blanks) is not supported; without reason: it is not known.
   pure type(refusal_t) function refusal_of(name) result(refusal)
      character(len=*), intent(in) :: name
      integer :: i

      do i = 1, size(refusals)
         if (index("," // squeezed(refusals(i)%names) // ",", "," // name // ",") > 0) then
            refusal = refusals(i)
         end if
      end do
   end function refusal_of

   !> All names, with a star, for suggestions.
   pure function keyword_names() result(list)
      type(string_t), allocatable :: list(:)
      character(len=:), allocatable :: names
      integer :: i

      names = ""
      do i = 1, size(keywords)
         names = names // trim(keywords(i)%name) // ","
      end do
      do i = 1, size(refusals)
         names = names // trim(refusals(i)%names) // ","
      end do
      allocate(list, source=entries(names))
      do i = 1, size(list)
         list(i)%text = "*" // list(i)%text
      end do
   end function keyword_names

   !> How a keyword with the list `parameters` takes the parameter `name`: one of `mark_`.
   pure integer function parameter_mark(parameters, name)
      character(len=*), intent(in) :: parameters, name
      type(string_t), allocatable :: list(:)
      integer :: i

      parameter_mark = mark_none
      allocate(list, source=entries(parameters))
      do i = 1, size(list)
         associate (text => list(i)%text)
            if (bare_name(text) /= name) cycle
            parameter_mark = mark_flag
            if (index(text, "=", .true.) == len(text)) parameter_mark = mark_value
            if (index(text, "?", .true.) == len(text)) parameter_mark = mark_either
            if (text(1:1) == "!") parameter_mark = mark_unsupported
            if (text(1:1) == "~") parameter_mark = mark_without_effect
            return
         end associate
      end do
   end function parameter_mark

   !> Whether `value` is the one with which the parameter `name` changes nothing.
   pure logical function is_neutral(parameters, name, value)
      character(len=*), intent(in) :: parameters, name, value
      real(wp) :: number, neutral
      integer :: first, last
      logical :: is_number

      first = max(index(parameters, "!" // name // ":"), index(parameters, "~" // name // ":"))
      is_neutral = first > 0
      if (.not. is_neutral) return
      first = first + len(name) + 2
      last = first + scan(trim(parameters(first:)) // ",", ",") - 2
      is_neutral = squeezed(value) == parameters(first:last)
      call read_real(parameters(first:last), neutral, is_number)
      if (is_number) call read_real(value, number, is_number)
      if (is_number) is_neutral = abs(number - neutral) <= 0.0_wp
   end function is_neutral

   !> Why a known parameter is not supported or has no effect: " (...)", or nothing where the
   !> name says it.
   pure subroutine parameter_reason(name, mark, reason)
      character(len=*), intent(in) :: name
      integer, intent(in) :: mark                !! how its keyword takes it
      character(len=:), allocatable, intent(out) :: reason

      reason = ""
      select case (name)
      case ("ALPHA")
         reason = " (the energy-momentum scheme has no numerical damping: *TIME INTEGRATION, " &
            // "SCHEME=GENERALIZED ALPHA has)"
      case ("ABSOLUTEPENETRATIONTOLERANCE", "RELATIVEPENETRATIONTOLERANCE")
         reason = " (contact is held exactly)"
      case ("SLIPTOLERANCE", "ELASTICSLIP")
         reason = " (a sticking contact does not slip)"
      case ("MASTER", "SLAVE")
         reason = " (the card is about all pairs)"
      case ("SMALLSLIDING")
         reason = " (contact follows the deformed surfaces)"
      case ("NOSEPARATION")
         reason = " (surfaces can separate; *TIE holds them together)"
      case ("RELATIVETOABSOLUTE")
         reason = " (motions are those in space)"
      case ("MULTISTAGE")
         reason = " (rings of unlike sectors are not joined)"
      case ("CONTACT")
         reason = " (a sector is tied to the next one, or free of it)"
      case ("TAUMAX")
         reason = " (nothing but the coefficient bounds friction)"
      case ("SHEARTRACTIONSLOPE")
         reason = " (a sticking contact does not slip)"
      case ("EXPONENTIALDECAY", "TESTDATA", "ANISOTROPIC")
         reason = " (friction has one coefficient, for stick and slip, both ways and at any speed)"
      case ("TIEDNSET")
         reason = " (whole surfaces are tied)"
      case ("POLYNOMIAL", "REDUCEDPOLYNOMIAL", "ARRUDA-BOYCE", "VANDERWAALS", "MARLOW")
         call law_titles("HYPERELASTIC", reason)
         reason = " (laws are " // reason // ")"
      case ("ANALYTICALSURFACE", "NSET", "PINNSET", "TIENSET")
         if (mark == mark_unsupported) reason = " (its nodes are NSET=, its elements ELSET=)"
         if (mark == mark_without_effect) reason = " (it does not narrow what is written)"
      case ("READ")
         reason = " (use: emcon restart NAME.rst.h5)"
      case ("INSTANCE")
         reason = " (there is no *ASSEMBLY)"
      case ("INPUT")
         reason = " (use *INCLUDE)"
      case default
         call further_reason(name, reason)
      end select
   end subroutine parameter_reason

   !> Of parameters that other programs have: what to do without them.
   pure subroutine further_reason(name, reason)
      character(len=*), intent(in) :: name
      character(len=:), allocatable, intent(out) :: reason

      select case (name)
      case ("RIKS")
         reason = " (*STATIC, STABILIZE goes on where a structure snaps through)"
      case ("PERTURBATION")
         reason = " (a step goes on from the state that it finds; leave it out)"
      case ("INPUT")
         reason = " (lines of other files come by *INCLUDE)"
      case ("DEPENDENCIES")
         reason = " (constants do not depend on temperature or fields)"
      case ("FOLLOWER")
         reason = " (forces keep their direction; pressures follow their faces)"
      case ("COMPOSITE", "STRUCTURAL")
         reason = " (damping is that of ALPHA and BETA)"
      case ("SYSTEM")
         reason = " (coordinates are those of the global axes)"
      case default
         reason = ""
      end select
   end subroutine further_reason

   !> The supported parameters of a list, for suggestions.
   pure function parameter_names(parameters) result(list)
      character(len=*), intent(in) :: parameters
      type(string_t), allocatable :: list(:)
      integer :: i, n

      allocate(list, source=entries(parameters))
      n = 0
      do i = 1, size(list)
         if (scan(list(i)%text(1:1), "!~") == 1) cycle
         n = n + 1
         list(n)%text = bare_name(list(i)%text)
      end do
      list = list(:n)
   end function parameter_names

   pure function bare_name(entry_text) result(name)
      character(len=*), intent(in) :: entry_text
      character(len=scan(entry_text // ":", ":=?") - 1 - min(1, scan(entry_text(:1), "!~"))) :: name

      name = entry_text(1 + min(1, scan(entry_text(:1), "!~")):)
   end function bare_name

end module emcon_deck_keywords
