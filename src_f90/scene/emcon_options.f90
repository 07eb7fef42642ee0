!> The options of decks that are one of a few words: each value is one row, which decks and their
!> messages, the log, the border, Python and the test of the documents are made from.
!>
!> Laws have more to say, in rows of their own: `emcon_law_registry`.
module emcon_options
   use emcon_couplings, only : tie_t
   use emcon_element_kind, only : element_row_t
   use emcon_element_registry, only : element_row, n_element_row
   use emcon_interactions, only : contact_options_t, contact_pair_t, formulation_user, &
      formulation_mortar, formulation_nts, formulation_segment, integration_elements, &
      integration_segments, multiplier_dual, multiplier_standard, normal_edge, normal_nodal, &
      smoothing_hermite, smoothing_none
   use emcon_materials, only : kinematics_corotated, kinematics_linear, kinematics_nonlinear, &
      section_t
   use emcon_mesh, only : surface_of_extrusion, surface_of_faces, surface_of_lines, &
      surface_of_nodes, surface_of_plane, surface_of_revolution, surface_of_segments, &
      surface_of_sphere, surface_of_triangles
   use emcon_scheme, only : scheme_row_t
   use emcon_scheme_registry, only : n_scheme_row, scheme_energy_momentum, scheme_row, &
      scheme_static
   use emcon_solver_registry, only : n_solver_row, solver_row, solver_row_t
   use emcon_steps, only : events_nodes, events_pairs, initiation_admissible, &
      initiation_auto, initiation_massless, initiation_persistent, initiation_velocity_update, &
      method_augmented_lagrange, method_null_space, method_penalty, method_saddle_point, &
      newton_full, newton_kept, step_t
   use emcon_text, only : squeezed
   implicit none
   private
   public :: option_row_t, n_option_row, option_row, option_code, option_default, option_refusal, &
      option_models, option_words, option_text

   integer, parameter :: n_plane = 2, n_space = 3

   !> One value that an option may have.
   type :: option_row_t
      character(len=14) :: kind                  !! the option
      integer :: code
      character(len=20) :: word                  !! in decks
      character(len=24) :: c_name                !! in the headers; empty: it is not there
      character(len=44) :: text                  !! in the log; empty: nothing is said
      character(len=40) :: also                  !! other words of decks, ",A,B,", without blanks
      integer :: n_dim = 0                       !! of the models that it is for; 0: of all
      logical :: is_axial = .true.               !! also for solids of revolution
      character(len=16) :: instead = ""          !! what other models use
   end type option_row_t

   !> Those that no other table has.
   type(option_row_t), parameter :: own(*) = [ &
      option_row_t("formulation", formulation_nts, "NODE TO SURFACE", "EMCON_NODE_TO_SEGMENT", &
         "node to segment", ""), &
      option_row_t("formulation", formulation_segment, "SEGMENT", "EMCON_SEGMENT", &
         "gaps of nodes integrated over slave edges", "", n_plane, instead="NODE TO SURFACE"), &
      option_row_t("formulation", formulation_mortar, "MORTAR", "EMCON_MORTAR", "mortar", &
         ",LINMORTAR,PGLINMORTAR,SURFACETOSURFACE,"), &
      option_row_t("formulation", formulation_user, "USER", "", "contact of the program", ""), &
      option_row_t("integration", integration_segments, "SEGMENTS", "EMCON_SEGMENTS", &
         "segments", ""), &
      option_row_t("integration", integration_elements, "ELEMENTS", "EMCON_ELEMENTS", &
         "element-wise integration", "", n_plane, instead="SEGMENTS"), &
      option_row_t("multiplier", multiplier_standard, "STANDARD", "EMCON_STANDARD", &
         "standard multipliers", ""), &
      option_row_t("multiplier", multiplier_dual, "DUAL", "EMCON_DUAL", "dual multipliers", ""), &
      option_row_t("tie multiplier", multiplier_standard, "STANDARD", "EMCON_STANDARD", &
         "standard multipliers", ""), &
      option_row_t("tie multiplier", multiplier_dual, "DUAL", "EMCON_DUAL", "dual multipliers", &
         ""), &
      option_row_t("normal", normal_edge, "EDGE", "EMCON_EDGE_NORMAL", "normals of edges", "", &
         n_plane, instead="NODAL"), &
      option_row_t("normal", normal_nodal, "NODAL", "EMCON_NODAL_NORMAL", "normals of nodes", ""), &
      option_row_t("smoothing", smoothing_none, "NONE", "EMCON_UNSMOOTHED", "", ""), &
      option_row_t("smoothing", smoothing_hermite, "HERMITE", "EMCON_HERMITE", &
         "smoothed master surface", "", n_plane, instead="NONE"), &
      option_row_t("initiation", initiation_auto, "AUTO", "", "", ""), &
      option_row_t("initiation", initiation_persistent, "PERSISTENT", "EMCON_PERSISTENT", &
         "PERSISTENT", ""), &
      option_row_t("initiation", initiation_admissible, "ADMISSIBLE", "EMCON_ADMISSIBLE", &
         "ADMISSIBLE", ""), &
      option_row_t("initiation", initiation_velocity_update, "VELOCITY UPDATE", "", &
         "VELOCITY UPDATE", ""), &
      option_row_t("initiation", initiation_massless, "MASSLESS", "", "MASSLESS", ""), &
      option_row_t("method", method_null_space, "NULL SPACE", "", "", ""), &
      option_row_t("method", method_saddle_point, "SADDLE POINT", "", "", ""), &
      option_row_t("method", method_penalty, "PENALTY", "", "by penalty", ""), &
      option_row_t("method", method_augmented_lagrange, "AUGMENTED LAGRANGE", "", &
         "by an augmented Lagrangian", ""), &
      option_row_t("newton", newton_kept, "KEPT", "", "", ""), &
      option_row_t("newton", newton_full, "FULL", "", "a tangent in each iteration", ""), &
      option_row_t("events", events_pairs, "PAIR", "", "of pairs", ""), &
      option_row_t("events", events_nodes, "NODE", "", "of nodes", ""), &
      option_row_t("kinematics", kinematics_nonlinear, "NONLINEAR", "", "", ""), &
      option_row_t("kinematics", kinematics_linear, "LINEAR", "", "small strains", "", &
         is_axial=.false., instead="NONLINEAR"), &
      option_row_t("kinematics", kinematics_corotated, "COROTATED", "", &
         "small strains in a frame that turns", "", n_plane, .false., "NONLINEAR"), &
      option_row_t("surface", surface_of_faces, "ELEMENT", "", "", ""), &
      option_row_t("surface", surface_of_nodes, "NODE", "", "", ""), &
      option_row_t("surface", surface_of_lines, "EDGE", "", "", "", n_plane, instead="ELEMENT"), &
      option_row_t("surface", surface_of_segments, "SEGMENTS", "", "", "", n_plane, &
         instead="ELEMENT"), &
      option_row_t("surface", surface_of_plane, "PLANE", "", "", "", n_space, &
         instead="ELEMENT"), &
      option_row_t("surface", surface_of_sphere, "SPHERE", "", "", "", n_space, &
         instead="ELEMENT"), &
      option_row_t("surface", surface_of_revolution, "REVOLUTION", "", "", "", n_space, &
         instead="ELEMENT"), &
      option_row_t("surface", surface_of_extrusion, "CYLINDER", "", "", "", n_space, &
         instead="ELEMENT"), &
      option_row_t("surface", surface_of_triangles, "STL", "", "", "", n_space, &
         instead="ELEMENT"), &
      option_row_t("procedure", scheme_static, "STATIC", "", "", ""), &
      option_row_t("procedure", scheme_energy_momentum, "DYNAMIC", "", "", "")]

contains

   pure integer function n_option_row()
      n_option_row = size(own) + n_solver_row() + n_choice() + n_element_row()
   end function n_option_row

   !> The schemes that *TIME INTEGRATION chooses from: statics, the first, is none.
   pure integer function n_choice()
      n_choice = n_scheme_row() - 1
   end function n_choice

   !> One of the rows of all options; those of an option follow each other.
   pure type(option_row_t) function option_row(i) result(row)
      integer, intent(in) :: i                   !! 1..n_option_row()
      type(element_row_t) :: element
      type(scheme_row_t) :: scheme
      type(solver_row_t) :: solver
      integer :: k

      k = i - size(own)
      if (k <= 0) then
         row = own(i)
      else if (k <= n_solver_row()) then
         solver = solver_row(k)
         row = option_row_t("solver", solver%code, solver%word, "", solver%text, "")
      else if (k <= n_solver_row() + n_choice()) then
         scheme = scheme_row(k - n_solver_row() + 1)
         row = option_row_t("scheme", scheme%code, scheme%word, "", scheme%text, "")
      else
         k = k - n_solver_row() - n_choice()
         element = element_row(k)
         row = option_row_t("element", k, element%name, "", "", "")
      end if
   end function option_row

   !> Code of the `word` of a deck; 0: there is none.
   pure integer function option_code(kind, word) result(code)
      character(len=*), intent(in) :: kind
      character(len=*), intent(in) :: word       !! upper case, without blanks
      type(option_row_t) :: row
      integer :: i

      code = 0
      if (word == "") return
      do i = 1, n_option_row()
         row = option_row(i)
         if (row%kind /= kind) cycle
         if (squeezed(row%word) == word .or. index(row%also, "," // word // ",") > 0) then
           code = row%code
         end if
      end do
   end function option_code

   !> Why a model cannot have a value, and what it can have instead; "": it can.
   pure subroutine option_refusal(kind, code, n_dim, is_flat, text)
      character(len=*), intent(in) :: kind
      integer, intent(in) :: code                !! one of that kind
      integer, intent(in) :: n_dim               !! of the model
      logical, intent(in) :: is_flat             !! it is plane, and not of solids of revolution
      character(len=:), allocatable, intent(out) :: text
      type(option_row_t) :: row
      integer :: i

      text = ""
      do i = 1, n_option_row()
         row = option_row(i)
         if (row%kind /= kind .or. row%code /= code) cycle
         if (row%n_dim > 0 .and. row%n_dim /= n_dim) then
            if (row%n_dim == n_plane) then
               text = " is for plane models, and this one has three dimensions; use "
            else
               text = " is for models in three dimensions, and this one is plane; use "
            end if
            text = trim(row%word) // text // trim(row%instead)
         else if (n_dim == n_plane .and. .not. (is_flat .or. row%is_axial)) then
            text = trim(row%word) // " is not for solids of revolution; use " // trim(row%instead)
         end if
      end do
   end subroutine option_refusal

   !> The models that may have a value, words of `emcon_get_option`.
   pure subroutine option_models(row, text)
      type(option_row_t), intent(in) :: row
      character(len=:), allocatable, intent(out) :: text

      text = "space"
      if (row%n_dim == n_space) return
      text = "plane"
      if (row%is_axial) text = text // " axial"
      if (row%n_dim == 0) text = text // " space"
   end subroutine option_models

   !> Code of an option that a deck does not speak of; < 0: it has to.
   pure integer function option_default(kind) result(code)
      character(len=*), intent(in) :: kind
      type(contact_options_t) :: contact
      type(contact_pair_t) :: pair
      type(section_t) :: section
      type(step_t) :: step
      type(tie_t) :: tie

      select case (kind)
      case ("formulation")
         code = pair%formulation
      case ("integration")
         code = contact%integration
      case ("multiplier")
         code = contact%multiplier
      case ("tie multiplier")
         code = tie%multiplier
      case ("normal")
         code = contact%normal
      case ("smoothing")
         code = contact%smoothing
      case ("surface")
         code = surface_of_faces
      case ("initiation")
         code = initiation_auto
      case ("events")
         code = step%time%events
      case ("kinematics")
         code = section%kinematics
      case ("method")
         code = step%contact%method
      case ("newton")
         code = step%solution%newton
      case ("scheme")
         code = scheme_energy_momentum
      case ("solver")
         code = step%solution%solver
      case default
         code = -1
      end select
   end function option_default

   !> The words that decks are told: "A, B".
   pure subroutine option_words(kind, list)
      character(len=*), intent(in) :: kind
      character(len=:), allocatable, intent(out) :: list
      type(option_row_t) :: row
      integer :: i

      list = ""
      do i = 1, n_option_row()
         row = option_row(i)
         if (row%kind /= kind) cycle
         if (list /= "") list = list // ", "
         list = list // trim(row%word)
      end do
   end subroutine option_words

   !> What the log says of a value; "" where it says nothing.
   pure subroutine option_text(kind, code, text)
      character(len=*), intent(in) :: kind
      integer, intent(in) :: code
      character(len=:), allocatable, intent(out) :: text
      type(option_row_t) :: row
      integer :: i

      text = ""
      do i = 1, n_option_row()
         row = option_row(i)
         if (row%kind == kind .and. row%code == code) text = trim(row%text)
      end do
   end subroutine option_text

end module emcon_options
