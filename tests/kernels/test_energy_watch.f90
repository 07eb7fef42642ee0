!> The energy balance of a run, by increments of several schemes whose figures are known.
module test_energy_watch
   use check, only : check_equal, check_near, check_true, test_case_t
   use emcon_energy_watch, only : closing_text, energy_bar, energy_follow, energy_is_failure, &
      energy_move, &
      energy_reasons, energy_rounding, energy_start, energy_warnings, energy_watch_t
   use emcon_errors, only : error_t
   use emcon_kinds, only : wp
   use emcon_ledger, only : ledger_t
   use emcon_scheme, only : scheme_t
   use emcon_scheme_registry, only : scheme_create, scheme_row
   use emcon_text, only : notes_t
   implicit none
   private
   public :: collect_energy_watch

   real(wp), parameter :: eps = epsilon(1.0_wp), tol = 16.0_wp*eps

contains

   subroutine collect_energy_watch(tests)
      type(test_case_t), allocatable, intent(out) :: tests(:)

      tests = [ &
         test_case_t("increments that keep energy", test_kept), &
         test_case_t("increments of other schemes, and of statics", test_shown), &
         test_case_t("penalties that store", test_stored), &
         test_case_t("a state that was set from outside", test_moved), &
         test_case_t("what works are made of", test_scale), &
         test_case_t("each reason by itself, at its bar", test_reasons), &
         test_case_t("a balance so bad that the run has failed", test_failure), &
         test_case_t("what impacts took is told, of explicit steps up to a bar", test_warnings)]
   end subroutine collect_energy_watch

   !> Follow an increment of the scheme `word`; "STATIC": none.
   subroutine follow(watch, ledger, word, is_stored)
      type(energy_watch_t), intent(inout) :: watch
      type(ledger_t), intent(in) :: ledger
      character(len=*), intent(in) :: word       !! in decks
      logical, intent(in) :: is_stored
      class(scheme_t), allocatable :: scheme

      if (word == "STATIC") then
         call scheme_create(scheme_row("STATIC", ""), scheme)
      else
         call scheme_create(scheme_row("DYNAMIC", word), scheme)
      end if
      call energy_follow(watch, ledger, scheme, is_stored, 0.0_wp)
   end subroutine follow

   type(ledger_t) function ledger_of(total, contact_work) result(ledger)
      real(wp), intent(in) :: total, contact_work

      ledger%total = total
      ledger%contact_work = contact_work
   end function ledger_of

   !> total - contact work + all that was taken stays; RESTITUTION asks for what it takes.
   subroutine test_kept(error)
      type(error_t), allocatable, intent(out) :: error
      type(energy_watch_t) :: watch
      type(ledger_t) :: ledger

      call energy_start(watch, ledger_of(-10.0_wp, 0.0_wp))
      call check_near(error, [watch%at_start, watch%reference, watch%shown_reference, &
         watch%largest], [-10.0_wp, -10.0_wp, -10.0_wp, 10.0_wp], tol, 10.0_wp, "start")
      call energy_start(watch, ledger_of(10.0_wp, 0.0_wp))
      ledger = ledger_of(5.0_wp, -0.5_wp)
      ledger%restitution = 0.125_wp
      ledger%kinetic = 7.0_wp
      ledger%strain = 4.0_wp
      ledger%decay = 1.0_wp
      ledger%damping = 0.5_wp
      ledger%friction = 0.25_wp
      ledger%contact_damping = 2.0_wp
      call follow(watch, ledger, "", .false.)
      call check_near(error, [watch%largest_error, watch%dynamic_error, watch%shown_reference, &
         watch%largest, watch%contact_reference, watch%contact_taken], [0.75_wp, 0.75_wp, 9.25_wp, &
         11.0_wp, -0.5_wp, 0.375_wp], tol, 10.0_wp, "figures")
      call check_true(error, watch%has_dynamics .and. .not. watch%has_explicit, "of dynamics")
      ! What is given back counts, and no increment forgets the most that was taken.
      ledger%contact_work = -0.25_wp
      call follow(watch, ledger, "", .false.)
      call check_near(error, [watch%contact_taken, watch%contact_sum, watch%dynamic_error, &
         watch%contact_made, watch%contact_kept], [0.375_wp, -0.125_wp, 1.0_wp, 0.0_wp, 0.0_wp], &
         tol, 10.0_wp, "given back")
   end subroutine test_kept

   !> What another scheme is off by is shown, from where it began; what contact makes in it counts,
   !> in statics nothing does.
   subroutine test_shown(error)
      type(error_t), allocatable, intent(out) :: error
      type(energy_watch_t) :: watch

      call energy_start(watch, ledger_of(10.0_wp, 0.0_wp))
      call follow(watch, ledger_of(13.0_wp, -1.0_wp), "STATIC", .false.)
      call check_near(error, [watch%shown_reference, watch%contact_reference, watch%reference, &
         watch%largest_error, watch%shown_error, watch%dynamic_error, watch%contact_taken], &
         [14.0_wp, -1.0_wp, 14.0_wp, 4.0_wp, 0.0_wp, 0.0_wp, 0.0_wp], tol, 10.0_wp, "statics")
      call check_true(error, .not. watch%has_dynamics, "no dynamics yet")
      call follow(watch, ledger_of(13.5_wp, -0.25_wp), "TRAPEZOIDAL", .false.)
      call check_near(error, [watch%shown_reference, watch%contact_reference, watch%reference, &
         watch%shown_error, watch%contact_made, watch%contact_sum], [14.0_wp, -1.0_wp, 13.75_wp, &
         0.25_wp, 0.75_wp, 0.75_wp], tol, 10.0_wp, "trapezoidal")
      call follow(watch, ledger_of(12.5_wp, -1.5_wp), "TRAPEZOIDAL", .false.)
      call check_near(error, [watch%shown_error, watch%contact_made, watch%contact_taken], &
         [0.25_wp, 0.75_wp, 0.5_wp], tol, 10.0_wp, "the most")
      call check_true(error, .not. watch%has_explicit, "implicit")
      call follow(watch, ledger_of(12.5_wp, -1.5_wp), "CENTRALDIFFERENCE", .false.)
      call follow(watch, ledger_of(12.5_wp, -1.5_wp), "", .false.)
      call check_true(error, watch%has_explicit .and. watch%has_dynamics, "explicit once")
   end subroutine test_shown

   !> Work of penalties from where they began; it is none that impacts take.
   subroutine test_stored(error)
      type(error_t), allocatable, intent(out) :: error
      type(energy_watch_t) :: watch

      call energy_start(watch, ledger_of(10.0_wp, 0.0_wp))
      call follow(watch, ledger_of(9.0_wp, -1.0_wp), "", .false.)
      call follow(watch, ledger_of(7.5_wp, -2.5_wp), "", .true.)
      call check_near(error, [watch%contact_kept, watch%contact_reference, watch%contact_taken], &
         [1.5_wp, -1.0_wp, 1.0_wp], tol, 10.0_wp, "stored")
      call follow(watch, ledger_of(10.0_wp, 0.0_wp), "", .true.)
      call check_near(error, watch%contact_kept, 1.5_wp, tol, 10.0_wp, "the most")
   end subroutine test_stored

   !> All references go with it, and nothing was taken by it.
   subroutine test_moved(error)
      type(error_t), allocatable, intent(out) :: error
      type(energy_watch_t) :: watch

      call energy_start(watch, ledger_of(10.0_wp, 0.0_wp))
      call energy_move(watch, ledger_of(10.0_wp, 0.0_wp), ledger_of(12.0_wp, -1.0_wp))
      call check_near(error, [watch%at_start, watch%reference, watch%shown_reference], &
         [13.0_wp, 13.0_wp, 13.0_wp], tol, 10.0_wp, "references")
      call follow(watch, ledger_of(12.0_wp, -1.0_wp), "", .false.)
      call check_near(error, [watch%largest_error, watch%dynamic_error, watch%contact_taken], &
         [0.0_wp, 0.0_wp, 0.0_wp], tol, 10.0_wp, "no error")
   end subroutine test_moved

   !> Root of the sum of squares of increments of all sizes: round-off is 16 epsilon of it.
   subroutine test_scale(error)
      type(error_t), allocatable, intent(out) :: error
      type(energy_watch_t) :: watch
      type(ledger_t) :: ledger
      class(scheme_t), allocatable :: scheme

      ledger%kinetic = 1.0_wp
      ledger%strain = -2.0_wp
      ledger%potential = -4.0_wp
      ledger%external_work = -8.0_wp
      ledger%contact_work = -16.0_wp
      ledger%contact_energy = -32.0_wp
      ledger%decay = -64.0_wp
      ledger%damping = -128.0_wp
      ledger%friction = -256.0_wp
      ledger%contact_damping = -512.0_wp
      call scheme_create(scheme_row("DYNAMIC", ""), scheme)
      call energy_start(watch, ledger)
      call energy_follow(watch, ledger, scheme, .false., 1024.0_wp)
      call energy_follow(watch, ledger, scheme, .false., 1024.0_wp)
      call check_near(error, watch%scale, 2047.0_wp*sqrt(2.0_wp), tol, 4096.0_wp, "scale")
      call check_near(error, energy_rounding(watch), 16.0_wp*eps*watch%scale, tol*eps, 4096.0_wp, &
         "round-off")
   end subroutine test_scale

   !> Ten per cent below its bar nothing is bad, ten above one thing is; with both signs of what may
   !> have both, and a bar that is wider where there is nothing but round-off.
   subroutine test_reasons(error)
      type(error_t), allocatable, intent(out) :: error
      real(wp), parameter :: largest = 4.0_wp
      type(energy_watch_t) :: watch
      type(notes_t) :: reasons
      character(len=:), allocatable :: digits
      real(wp) :: x
      integer :: k, over

      do k = 1, 7
         do over = 0, 1
            watch = energy_watch_t(largest=largest)
            x = largest*(0.9_wp + 0.2_wp*over)
            select case (k)
            case (1)
               watch%stabilization = x*sqrt(eps)
            case (2)
               watch%stabilization = -x*sqrt(eps)
            case (3)
               watch%dynamic_error = x*energy_bar
            case (4)
               watch%contact_made = x*sqrt(eps)
            case (5)
               watch%contact_kept = x*energy_bar
            case (6)
               watch%contact_taken = 0.05_wp*x
               watch%has_explicit = .true.
            case (7)
               watch%contact_taken = x
               if (over == 1) watch%scale = x/eps
               watch%has_explicit = over == 1
            end select
            reasons = notes_t()
            call energy_reasons(watch, reasons)
            call check_equal(error, reasons%n, merge(over, 0, k < 7), "reasons")
            if (k == 3 .and. over == 1) then
               call closing_text(digits)
               call check_true(error, index(reasons%item(1)%text, "the energy balance does NOT " &
                  // "close to " // digits // " digits (") == 1, reasons%item(1)%text)
               if (precision(1.0_wp) == 15) call check_equal(error, digits, "ten", "in double")
            end if
            if (k >= 6) cycle
            watch%scale = 0.3_wp*x*sqrt(eps)/(16.0_wp*eps)
            reasons = notes_t()
            call energy_reasons(watch, reasons)
            call check_equal(error, reasons%n, 0, "round-off")
         end do
      end do
   end subroutine test_reasons

   !> A part of the largest energy, and what is round-off beyond it.
   subroutine test_failure(error)
      type(error_t), allocatable, intent(out) :: error
      real(wp), parameter :: largest = 4.0_wp, bar = merge(1.0e-6_wp, 1.0e-2_wp, &
         precision(1.0_wp) >= 15)
      type(energy_watch_t) :: watch
      integer :: k

      do k = 0, 16
         watch = energy_watch_t(largest=largest, dynamic_error=0.1_wp*(k + 0.01_wp)*bar*largest)
         call check_true(error, energy_is_failure(watch) .eqv. k >= 10, "above the bar")
         watch%scale = 0.25_wp*bar*largest/(16.0_wp*eps)
         call check_true(error, energy_is_failure(watch) .eqv. k >= 13, "and round-off")
      end do
   end subroutine test_failure

   !> More than a hundredth; of explicit steps not what is bad by itself.
   subroutine test_warnings(error)
      type(error_t), allocatable, intent(out) :: error
      real(wp), parameter :: part(3) = [0.009_wp, 0.011_wp, 0.051_wp]
      real(wp), parameter :: wide(4) = [0.025_wp, 0.035_wp, 0.065_wp, 0.075_wp]
      integer, parameter :: told(4) = [0, 1, 1, 0], bad(4) = [0, 0, 0, 1]
      type(energy_watch_t) :: watch
      type(notes_t) :: warnings, reasons
      integer :: k, n(3, 3)

      do k = 1, 3
         watch = energy_watch_t(largest=2.0_wp, contact_taken=2.0_wp*part(k))
         warnings = notes_t()
         call energy_warnings(watch, warnings)
         n(k, 1) = warnings%n
         watch%has_explicit = .true.
         warnings = notes_t()
         call energy_warnings(watch, warnings)
         n(k, 2) = warnings%n
         watch%scale = watch%contact_taken/eps
         warnings = notes_t()
         call energy_warnings(watch, warnings)
         n(k, 3) = warnings%n
      end do
      call check_equal(error, reshape(n, [9]), [0, 1, 1, 0, 1, 0, 0, 0, 0], "warnings")
      ! Round-off of 0.02 comes to both bars.
      do k = 1, 4
         watch = energy_watch_t(largest=2.0_wp, contact_taken=2.0_wp*wide(k), has_explicit=.true., &
            scale=2.0_wp*0.02_wp/(16.0_wp*eps))
         warnings = notes_t()
         call energy_warnings(watch, warnings)
         call energy_reasons(watch, reasons)
         call check_equal(error, [warnings%n, reasons%n], [told(k), bad(k)], "with round-off")
      end do
   end subroutine test_warnings

end module test_energy_watch
