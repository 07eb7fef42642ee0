!> What a run tells of itself: the lines of the log and the closing balance.
module emcon_run_log
   use emcon_element_kinds, only : element_kinds
   use emcon_kinds, only : wp
   use emcon_link_lines, only : add_link_lines
   use emcon_log, only : log_line, log_t
   use emcon_march, only : increment_t
   use emcon_scene, only : contact_options_t, formulation_mortar, formulation_segment, &
      integration_elements, multiplier_dual, normal_nodal, scene_t, smoothing_hermite
   use emcon_stepper, only : stepper_t
   use emcon_text, only : notes_t, string_t, to_text
   use emcon_version, only : version
   implicit none
   private
   public :: balance_t, log_start, log_increment, model_lines, closing_lines

   !> Error of the energy balance, relative to the largest energy, that the verdict accepts.
   real(wp), parameter :: ten_digits = 1.0e-10_wp
   !> Residuals told per increment, at most.
   integer, parameter :: most_residuals = 15

   !> The running balance of a run.
   type :: balance_t
      real(wp) :: total0 = 0.0_wp                !! total energy at the start
      real(wp) :: largest_drift = 0.0_wp         !! of total - contact work
      real(wp) :: largest_energy = 0.0_wp
      real(wp) :: deepest = 0.0_wp               !! smallest gap per master edge, 0 if all open
      integer :: n_newton = 0
      integer :: n_cut = 0
      real(wp), allocatable :: largest_force(:)  !! (n_pair) on the slave side
   end type balance_t

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
      type(notes_t) :: links
      integer :: i, k

      allocate(line(0))
      associate (scene => stepper%scene, system => stepper%march%system)
         if (len_trim(scene%heading) > 0) call add(trim(scene%heading))
         call add(to_text(size(scene%x, 2)) // " nodes, " // &
            to_text(system%numbering%n_unknown) // " unknowns in step 1, " // &
            to_text(system%n_body) // " bodies")
         do k = 1, size(element_kinds)
            if (any(scene%element_kind == k)) call add(to_text(count(scene%element_kind == k)) // &
               " elements " // trim(element_kinds(k)%name))
         end do
         call add_link_lines(scene, system, links)
         do k = 1, links%n
            call add(links%item(k)%text)
         end do
         do k = 1, size(scene%pair)
            call add("contact: " // scene%surface(scene%pair(k)%slave)%name // " (slave, " // &
               to_text(system%contact(k)%contact%n_constraint) // " nodes) on " // &
               scene%surface(scene%pair(k)%master)%name // ", " // &
               formulation_text(scene%pair(k)%formulation, scene%step(1)%contact))
         end do
         do k = 1, size(scene%step)
            call add("step " // to_text(k) // ": duration " // to_text(scene%step(k)%duration) // &
               ", h = " // to_text(scene%step(k)%h) // &
               merge(", NLGEOM", "        ", scene%step(k)%nlgeom))
            do i = 1, size(scene%pair)
               if (.not. has_changed(scene, i, k)) cycle
               call add("   contact " // pair_text(scene, i) // ": " // &
                  formulation_text(scene%pair(i)%formulation, scene%step(k)%contact))
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

   !> The surfaces of a pair, the slave first.
   pure function pair_text(scene, pair) result(text)
      type(scene_t), intent(in) :: scene
      integer, intent(in) :: pair
      character(len=:), allocatable :: text

      text = scene%surface(scene%pair(pair)%slave)%name // " on " // &
         scene%surface(scene%pair(pair)%master)%name
   end function pair_text

   !> Is a pair computed otherwise in step `k` than in the step before?
   pure logical function has_changed(scene, pair, k)
      type(scene_t), intent(in) :: scene
      integer, intent(in) :: pair, k

      has_changed = .false.
      if (k == 1) return
      associate (formulation => scene%pair(pair)%formulation)
         has_changed = formulation_text(formulation, scene%step(k)%contact) &
            /= formulation_text(formulation, scene%step(k - 1)%contact)
      end associate
   end function has_changed

   !> How contact is computed: of the options those that the formulation has use for.
   pure function formulation_text(formulation, options) result(text)
      integer, intent(in) :: formulation         !! one of the `formulation_` codes
      type(contact_options_t), intent(in) :: options
      character(len=:), allocatable :: text

      select case (formulation)
      case (formulation_mortar)
         text = "mortar, " // integration_text(options) // ", " // multiplier_text(options) // &
            ", " // normal_text(options)
      case (formulation_segment)
         text = "gaps of nodes integrated over slave edges, " // multiplier_text(options)
      case default
         text = "node to segment"
      end select
      if (options%smoothing == smoothing_hermite) text = text // &
         ", smoothed master surface" // corner_text(options%smoothing_angle)
   end function formulation_text

   pure function integration_text(options) result(text)
      type(contact_options_t), intent(in) :: options
      character(len=:), allocatable :: text

      text = "segments"
      if (options%integration == integration_elements) text = "element-wise integration"
      if (options%n_point > 0) text = text // " with " // to_text(options%n_point) // " points"
   end function integration_text

   pure function multiplier_text(options) result(text)
      type(contact_options_t), intent(in) :: options
      character(len=:), allocatable :: text

      text = "standard multipliers"
      if (options%multiplier == multiplier_dual) text = "dual multipliers"
   end function multiplier_text

   pure function normal_text(options) result(text)
      type(contact_options_t), intent(in) :: options
      character(len=:), allocatable :: text

      text = "normals of edges"
      if (options%normal == normal_nodal) text = "normals of nodes" // &
         corner_text(options%normal_angle)
   end function normal_text

   pure function corner_text(angle) result(text)
      real(wp), intent(in) :: angle              !! [degrees]
      character(len=:), allocatable :: text

      text = " (corners beyond " // to_text(angle) // " degrees)"
   end function corner_text

   !> One line per increment and its remarks, and the running balance.
   subroutine log_increment(log, stepper, increment, balance)
      type(log_t), intent(inout) :: log
      type(stepper_t), intent(in) :: stepper
      type(increment_t), intent(in) :: increment
      type(balance_t), intent(inout) :: balance
      character(len=320) :: line
      integer :: i, n

      do i = 1, increment%notes%n
         call log_line(log, "   " // increment%notes%item(i)%text)
      end do
      balance%n_newton = balance%n_newton + increment%n_newton
      balance%n_cut = balance%n_cut + increment%n_cut
      balance%deepest = min(balance%deepest, increment%deepest)
      call note_forces(balance, stepper)
      associate (state => stepper%march%state, ledger => stepper%march%ledger)
         balance%largest_energy = max(balance%largest_energy, abs(balance%total0), &
            ledger%kinetic + ledger%strain)
         balance%largest_drift = max(balance%largest_drift, &
            abs(ledger%total - ledger%contact_work - balance%total0))
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

   !> Keep the largest force of each pair.
   subroutine note_forces(balance, stepper)
      type(balance_t), intent(inout) :: balance
      type(stepper_t), intent(in) :: stepper
      integer :: k

      associate (total => stepper%march%state%pairs%total)
         if (.not. allocated(balance%largest_force)) then
            allocate(balance%largest_force(size(total)), source=0.0_wp)
         end if
         do k = 1, size(total)
            balance%largest_force(k) = max(balance%largest_force(k), norm2(total(k)%slave(:2)))
         end do
      end associate
   end subroutine note_forces

   !> The closing balance and the verdict.
   function closing_lines(stepper, balance) result(line)
      type(stepper_t), intent(in) :: stepper
      type(balance_t), intent(in) :: balance
      type(string_t), allocatable :: line(:)
      real(wp) :: scale
      integer :: k

      allocate(line(0))
      if (stepper%march%state%increment == 0) return
      associate (state => stepper%march%state, ledger => stepper%march%ledger)
         scale = max(balance%largest_energy, tiny(scale))
         call add("increments " // to_text(state%increment) // ", time " // &
            to_text(state%time, 9) // ", Newton iterations " // to_text(balance%n_newton) // &
            ", cuts " // to_text(balance%n_cut))
         call add("energy: kinetic " // to_text(ledger%kinetic, 9) // ", strain " // &
            to_text(ledger%strain, 9) // ", external work " // to_text(ledger%external_work, 9) // &
            ", contact work " // to_text(ledger%contact_work, 9))
         call add("total at start " // to_text(balance%total0, 12) // ", at end " // &
            to_text(ledger%total, 12))
         call add("largest error of the energy balance " // &
            to_text(balance%largest_drift/scale, 3) // &
            " of the largest energy, deepest penetration " // to_text(-balance%deepest, 3) // &
            " of an element")
         do k = 1, size(stepper%scene%pair)
            call add("contact " // pair_text(stepper%scene, k) // ": " // &
               to_text(state%pairs%total(k)%n_active) // " active at end, largest force " // &
               to_text(balance%largest_force(k), 9))
         end do
         if (.not. stepper%march%scheme%has_inertia) return
         if (balance%largest_drift <= ten_digits*scale) then
            call add("verdict: the energy balance closes to ten digits or better")
         else
            call add("verdict: the energy balance does NOT close to ten digits")
         end if
      end associate

   contains

      subroutine add(text)
         character(len=*), intent(in) :: text
         type(string_t) :: new(1)

         new(1)%text = text
         line = [line, new]
      end subroutine add

   end function closing_lines

end module emcon_run_log
