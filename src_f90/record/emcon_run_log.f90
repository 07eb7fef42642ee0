!> What a run tells of itself: the lines of the log.
module emcon_run_log
   use emcon_deck_dimension, only : n_plane
   use emcon_guards, only : corner_slack, crossing_slack, guard_slack
   use emcon_interactions, only : contact_options_t, formulation_mortar, formulation_segment, &
      normal_nodal, smoothing_none
   use emcon_kinds, only : wp
   use emcon_link_lines, only : add_link_lines
   use emcon_log, only : log_line, log_lines, log_t
   use emcon_march, only : increment_t
   use emcon_options, only : option_text
   use emcon_report_row, only : report_rows_t
   use emcon_scene, only : scene_t
   use emcon_scene_report, only : scene_report
   use emcon_scheme_registry, only : scheme_user
   use emcon_solver_registry, only : solver_user
   use emcon_sort, only : unique_sorted
   use emcon_stepper, only : stepper_t
   use emcon_system, only : system_t
   use emcon_text, only : note_add, notes_append, notes_t, string_t, to_text
   use emcon_version, only : precision_names, this_precision, version
   implicit none
   private
   public :: log_start, log_increment, model_lines

   !> Residuals told per increment, at most.
   integer, parameter :: most_residuals = 15

contains

   !> Head of the log: program, deck, model, remarks.
   subroutine log_start(log, stepper, diagnostic, path)
      type(log_t), intent(inout) :: log
      type(stepper_t), intent(inout) :: stepper
      type(string_t), intent(in) :: diagnostic(:)    !! of the deck
      character(len=*), intent(in) :: path
      type(report_rows_t) :: rows
      integer :: k

      call log_line(log, "EMCON " // version // ", " // trim(precision_names(this_precision)) &
         // " precision, deck " // path)
      call log_lines(log, "with ", notes_t(size(stepper%override), stepper%override))
      call log_lines(log, "", notes_t(size(diagnostic), diagnostic))
      call log_lines(log, "", model_notes(stepper))
      call scene_report(stepper, rows)
      do k = 1, rows%n
         call log_line(log, rows%row(k)%text)
      end do
      call log_line(log, "")
      call log_line(log, " increment          time             h newton cuts active" // &
         "          kinetic           strain            total  residuals of the last solve")
   end subroutine log_start

   !> What is modelled, in a few lines.
   function model_lines(stepper) result(line)
      type(stepper_t), intent(in) :: stepper
      type(string_t), allocatable :: line(:)
      type(notes_t) :: notes

      notes = model_notes(stepper)
      line = notes%item(:notes%n)
   end function model_lines

   function model_notes(stepper) result(notes)
      type(stepper_t), intent(in) :: stepper
      type(notes_t) :: notes
      character(len=:), allocatable :: how
      integer :: k

      associate (scene => stepper%scene, system => stepper%march%system)
         if (len_trim(scene%deck%heading) > 0) call note_add(notes, trim(scene%deck%heading))
         if (allocated(scene%deck%labels)) call note_add(notes, scene%deck%labels)
         if (allocated(scene%deck%idle)) call note_add(notes, "changes nothing: " &
            // scene%deck%idle)
         call note_add(notes, to_text(size(scene%x, 2)) // " nodes, " // &
            to_text(system%space%numbering%n_unknown) // " unknowns in step 1, " // &
            to_text(system%space%n_body) // " bodies")
         do k = 1, size(scene%element%kinds)
            if (any(scene%element%kind == k)) call note_add(notes, &
               to_text(count(scene%element%kind == k)) // " elements " &
               // trim(scene%element%kinds(k)%name))
         end do
         call add_link_lines(scene, system, notes)
         do k = 1, size(scene%pair)
            call formulation_text(scene%pair(k)%formulation, scene%step(1)%contact%options, &
               scene%n_dim, how)
            call add_pair(scene, k, size(unique_sorted(system%contact(k)%contact%node)), how, notes)
         end do
         call add_watching(scene, system, notes)
         do k = 1, size(scene%step)
            call add_step(notes, scene, k)
         end do
      end associate
      call notes_append(notes, stepper%notes)
   end function model_notes

   !> Which surface is the slave of pair `k`, and on what its nodes are held.
   subroutine add_pair(scene, k, n_node, how, notes)
      type(scene_t), intent(in) :: scene
      integer, intent(in) :: k
      integer, intent(in) :: n_node              !! held ones
      character(len=*), intent(in) :: how        !! formulation
      type(notes_t), intent(inout) :: notes
      character(len=:), allocatable :: text

      associate (pair => scene%pair(k))
         text = "contact: " // scene%surface(pair%slave)%name
         if (pair%slave == pair%master) then
            text = text // " (" // to_text(n_node) // " nodes) with itself, "
         else
            text = text // " (slave, " // to_text(n_node) // " nodes" // trim(merge( &
               ", named second", "              ", pair%is_exchanged)) // ") on " // &
               scene%surface(pair%master)%name // ", "
         end if
      end associate
      call note_add(notes, text // how)
   end subroutine add_pair

   !> What is held beside the pairs.
   subroutine add_watching(scene, system, notes)
      type(scene_t), intent(in) :: scene
      type(system_t), intent(in) :: system
      type(notes_t), intent(inout) :: notes
      character(len=:), allocatable :: text
      logical :: has_guards
      integer :: k

      has_guards = .false.
      do k = system%n_pair + 1, size(system%contact)
         associate (contact => system%contact(k)%contact, &
               pair => scene%pair(abs(system%contact(k)%of_pair)))
            has_guards = has_guards .or. contact%slack > 0.0_wp
            if (contact%slack > 0.0_wp .or. contact%n_constraint == 0) cycle
            if (pair%slave == pair%master) then
               text = scene%surface(pair%slave)%name // " that cross each other"
            else
               text = scene%surface(pair%slave)%name // " and " // &
                  scene%surface(pair%master)%name // " that cross"
            end if
            call note_add(notes, "contact: edges of " // text // " are constrained: sharp " // &
               "ones at " // &
               "once, others when they are deeper than " // to_text(crossing_slack) // " of a face")
         end associate
      end do
      if (has_guards) call note_add(notes, "contact: guards stop nodes that the pairs do not: " // &
         "corners deeper than " // to_text(corner_slack, 3) // " of an edge, other nodes " // &
         "deeper than " // to_text(guard_slack))
   end subroutine add_watching

   !> What step `k` is, and where contact is computed otherwise than in the step before.
   subroutine add_step(notes, scene, k)
      type(notes_t), intent(inout) :: notes
      type(scene_t), intent(in) :: scene
      integer, intent(in) :: k
      character(len=:), allocatable :: scheme, solver, before, how
      integer :: i

      associate (step => scene%step(k))
         call option_text("solver", step%solution%solver, solver)
         if (step%solution%solver == solver_user) solver = step%solution%solver_name
         scheme = trim(step%scheme%text)
         if (step%scheme%code == scheme_user) scheme = "scheme " // step%choice%name
         associate (setting => step%scheme%setting)
            if (setting%word /= "") scheme = scheme // " (" // trim(setting%word) // "=" // &
               to_text(setting%value) // ")"
         end associate
         call note_add(notes, "step " // to_text(k) // ": duration " &
            // to_text(step%time%duration) // &
            ", h = " // to_text(step%time%h) // trim(merge(", NLGEOM", "        ", &
            step%nlgeom)) // ", " // scheme // ", solver " // solver)
         if (.not. step%solution%polishes) call note_add(notes, &
            "Newton's method ends where the residual is " // &
            "within " // to_text(step%solution%newton_tolerance) &
            // ": the energy is kept to about that, not to round-off")
      end associate
      if (k == 1) return
      do i = 1, size(scene%pair)
         associate (pair => scene%pair(i))
            call formulation_text(pair%formulation, scene%step(k - 1)%contact%options, &
               scene%n_dim, before)
            call formulation_text(pair%formulation, scene%step(k)%contact%options, scene%n_dim, how)
            if (how /= before) call note_add(notes, "   contact " // &
               scene%surface(pair%slave)%name // " on " // scene%surface(pair%master)%name // &
               ": " // how)
         end associate
      end do
   end subroutine add_step

   !> How contact is computed: of the options those that the formulation has use for.
   pure subroutine formulation_text(formulation, options, n_dim, text)
      integer, intent(in) :: formulation         !! one of the `formulation_` codes
      type(contact_options_t), intent(in) :: options
      integer, intent(in) :: n_dim               !! in space gaps are integrated in one way
      character(len=:), allocatable, intent(out) :: text
      logical :: is_plane

      is_plane = n_dim == n_plane
      call option_text("formulation", formulation, text)
      if (formulation == formulation_mortar .and. is_plane) then
         call add_option(text, "integration", options%integration)
         if (options%n_point > 0) text = text // " with " // to_text(options%n_point) // " points"
      end if
      if (any(formulation == [formulation_mortar, formulation_segment])) then
        call add_option(text, "multiplier", options%multiplier)
      end if
      if (.not. is_plane) return
      if (formulation == formulation_mortar) then
         call add_option(text, "normal", options%normal)
         if (options%normal == normal_nodal) call add_corner(text, options%normal_angle)
      end if
      if (options%smoothing /= smoothing_none) then
         call add_option(text, "smoothing", options%smoothing)
         call add_corner(text, options%smoothing_angle)
      end if
   end subroutine formulation_text

   pure subroutine add_option(text, kind, code)
      character(len=:), allocatable, intent(inout) :: text
      character(len=*), intent(in) :: kind
      integer, intent(in) :: code
      character(len=:), allocatable :: more

      call option_text(kind, code, more)
      text = text // ", " // more
   end subroutine add_option

   !> Add the angle beyond which a kink is a corner.
   pure subroutine add_corner(text, angle)
      character(len=:), allocatable, intent(inout) :: text
      real(wp), intent(in) :: angle              !! [degrees]

      text = text // " (corners beyond " // to_text(angle) // " degrees)"
   end subroutine add_corner

   !> One line per increment, its remarks and its warnings.
   subroutine log_increment(log, stepper, increment)
      type(log_t), intent(inout) :: log
      type(stepper_t), intent(in) :: stepper
      type(increment_t), intent(in) :: increment
      character(len=320) :: line
      integer :: n

      call log_lines(log, "   ", increment%notes)
      call log_lines(log, "   warning: ", increment%warnings)
      associate (state => stepper%march%state, ledger => stepper%march%ledger)
         write(line, "(i10, 2es14.6, i7, i5, i7, 3es17.9)") state%clock%increment, &
            state%clock%time, increment%h, increment%n_newton, increment%n_cut, &
            increment%n_active, ledger%kinetic, ledger%strain, ledger%total
      end associate
      if (allocated(increment%residual)) then
         n = min(size(increment%residual), most_residuals)
         write(line(len_trim(line) + 1:), "(*(es9.1))") increment%residual(:n)
      end if
      call log_line(log, trim(line))
   end subroutine log_increment

end module emcon_run_log
