!> What a run tells of itself: the lines of the log.
module emcon_run_log
   use emcon_guards, only : guard_slack
   use emcon_interactions, only : contact_options_t, formulation_mortar, formulation_segment, &
      normal_nodal, smoothing_none
   use emcon_kinds, only : wp
   use emcon_link_lines, only : add_link_lines
   use emcon_log, only : log_line, log_t
   use emcon_march, only : increment_t
   use emcon_options, only : option_text
   use emcon_scene, only : scene_t
   use emcon_scheme_registry, only : scheme_given
   use emcon_solver_registry, only : solver_given
   use emcon_stepper, only : stepper_t
   use emcon_steps, only : step_t
   use emcon_text, only : notes_t, string_t, to_text
   use emcon_version, only : version
   implicit none
   private
   public :: log_start, log_increment, model_lines

   !> Residuals told per increment, at most.
   integer, parameter :: most_residuals = 15

contains

   !> Head of the log: program, deck, model, remarks.
   subroutine log_start(log, stepper, diagnostic, path)
      type(log_t), intent(inout) :: log
      type(stepper_t), intent(in) :: stepper
      type(string_t), intent(in) :: diagnostic(:)    !! of the deck
      character(len=*), intent(in) :: path
      type(string_t), allocatable :: line(:)
      integer :: i

      call log_line(log, "EMCON " // version // ", deck " // path)
      do i = 1, size(stepper%override)
         call log_line(log, "with " // stepper%override(i)%text)
      end do
      do i = 1, size(diagnostic)
         call log_line(log, diagnostic(i)%text)
      end do
      allocate(line, source=model_lines(stepper))
      do i = 1, size(line)
         call log_line(log, line(i)%text)
      end do
      call log_line(log, "")
      call log_line(log, " increment          time             h newton cuts active" // &
         "          kinetic           strain            total  residuals of the last solve")
   end subroutine log_start

   !> What is modelled, in a few lines.
   function model_lines(stepper) result(line)
      type(stepper_t), intent(in) :: stepper
      type(string_t), allocatable :: line(:)
      character(len=:), allocatable :: how
      type(notes_t) :: links
      integer :: i, k

      allocate(line(0))
      associate (scene => stepper%scene, system => stepper%march%system)
         if (len_trim(scene%heading) > 0) call add(trim(scene%heading))
         call add(to_text(size(scene%x, 2)) // " nodes, " // &
            to_text(system%space%numbering%n_unknown) // " unknowns in step 1, " // &
            to_text(system%space%n_body) // " bodies")
         do k = 1, size(scene%kind)
            if (any(scene%element_kind == k)) call add(to_text(count(scene%element_kind == k)) // &
               " elements " // trim(scene%kind(k)%name))
         end do
         call add_link_lines(scene, system, links)
         do k = 1, links%n
            call add(links%item(k)%text)
         end do
         do k = 1, size(scene%pair)
            call formulation_text(scene%pair(k)%formulation, scene%step(1)%contact, how)
            call add("contact: " // scene%surface(scene%pair(k)%slave)%name // " (slave, " // &
               to_text(system%contact(k)%contact%n_constraint) // " nodes" // &
               trim(merge(", the rounder one", "                 ", &
               scene%pair(k)%is_exchanged)) // ") on " // &
               scene%surface(scene%pair(k)%master)%name // ", " // how)
         end do
         if (system%n_pair < size(system%contact)) call add("contact: guards hold nodes that " // &
            "the pairs do not, deeper than " // to_text(guard_slack) // " of an edge")
         do k = 1, size(scene%step)
            call solver_text(scene%step(k), how)
            call add("step " // to_text(k) // ": duration " // to_text(scene%step(k)%duration) // &
               ", h = " // to_text(scene%step(k)%h) // &
               trim(merge(", NLGEOM", "        ", scene%step(k)%nlgeom)) // ", " // &
               scheme_text(scene%step(k)) // ", solver " // how)
            do i = 1, size(scene%pair)
               if (.not. has_changed(scene, i, k)) cycle
               call formulation_text(scene%pair(i)%formulation, scene%step(k)%contact, how)
               call add("   contact " // scene%surface(scene%pair(i)%slave)%name // " on " // &
                  scene%surface(scene%pair(i)%master)%name // ": " // how)
            end do
         end do
      end associate
      do k = 1, stepper%notes%n
         call add(stepper%notes%item(k)%text)
      end do

   contains

      subroutine add(text)
         character(len=*), intent(in) :: text
         type(string_t) :: new(1)

         new(1)%text = trim(text)
         line = [line, new]
      end subroutine add

   end function model_lines

   !> How a step goes on in time.
   pure function scheme_text(step) result(text)
      type(step_t), intent(in) :: step
      character(len=scheme_length(step)) :: text

      text = step%scheme%text
      if (step%scheme%code == scheme_given) text = "scheme " // step%choice%name
   end function scheme_text

   pure integer function scheme_length(step) result(n)
      type(step_t), intent(in) :: step

      n = len_trim(step%scheme%text)
      if (step%scheme%code == scheme_given) n = len("scheme ") + len(step%choice%name)
   end function scheme_length

   !> What factorises the matrices of a step.
   pure subroutine solver_text(step, text)
      type(step_t), intent(in) :: step
      character(len=:), allocatable, intent(out) :: text

      if (step%solver == solver_given) then
         text = step%solver_name
      else
         call option_text("solver", step%solver, text)
      end if
   end subroutine solver_text

   !> Is a pair computed otherwise in step `k` than in the step before?
   pure logical function has_changed(scene, pair, k)
      type(scene_t), intent(in) :: scene
      integer, intent(in) :: pair, k
      character(len=:), allocatable :: before, after

      has_changed = .false.
      if (k == 1) return
      associate (formulation => scene%pair(pair)%formulation)
         call formulation_text(formulation, scene%step(k - 1)%contact, before)
         call formulation_text(formulation, scene%step(k)%contact, after)
      end associate
      has_changed = after /= before
   end function has_changed

   !> How contact is computed: of the options those that the formulation has use for.
   pure subroutine formulation_text(formulation, options, text)
      integer, intent(in) :: formulation         !! one of the `formulation_` codes
      type(contact_options_t), intent(in) :: options
      character(len=:), allocatable, intent(out) :: text

      call option_text("formulation", formulation, text)
      if (formulation == formulation_mortar) then
         call add_option(text, "integration", options%integration)
         if (options%n_point > 0) text = text // " with " // to_text(options%n_point) // " points"
      end if
      if (any(formulation == [formulation_mortar, formulation_segment])) then
        call add_option(text, "multiplier", options%multiplier)
      end if
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
      integer :: i, n

      do i = 1, increment%notes%n
         call log_line(log, "   " // increment%notes%item(i)%text)
      end do
      do i = 1, increment%warnings%n
         call log_line(log, "   warning: " // increment%warnings%item(i)%text)
      end do
      associate (state => stepper%march%state, ledger => stepper%march%ledger)
         write(line, "(i10, 2es14.6, i7, i5, i7, 3es17.9)") state%increment, state%time, &
            increment%h, increment%n_newton, increment%n_cut, increment%n_active, &
            ledger%kinetic, ledger%strain, ledger%total
      end associate
      if (allocated(increment%residual)) then
         n = min(size(increment%residual), most_residuals)
         write(line(len_trim(line) + 1:), "(*(es9.1))") increment%residual(:n)
      end if
      call log_line(log, trim(line))
   end subroutine log_increment

end module emcon_run_log
