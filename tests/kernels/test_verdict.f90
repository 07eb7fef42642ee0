!> The verdict from running figures.
module test_verdict
   use check, only : check_equal, check_near, check_true, test_case_t
   use emcon_constraint, only : condition_t
   use emcon_constraints, only : constraint_set_t
   use emcon_errors, only : error_t
   use emcon_interactions, only : contact_pair_t, formulation_mortar, formulation_segment
   use emcon_energy_watch, only : energy_rounding
   use emcon_far_nodes, only : far_element_find
   use emcon_force_scatter, only : force_scatter_t, scatter_follow, scatter_is_comb, scatter_of
   use emcon_kinds, only : wp
   use emcon_march, only : march_begin_step, march_free, march_init, march_t
   use emcon_nodal_pull, only : nodal_pull_add, nodal_pull_share, nodal_pull_t, nodal_pull_text
   use emcon_pair_sums, only : pair_sum_t
   use emcon_scene, only : scene_t
   use emcon_verdict, only : verdict_end, verdict_is_failure, verdict_is_good, verdict_start, &
      verdict_t
   use emcon_verdict_lines, only : guard_advice, verdict_line
   use small_scenes, only : add_step, block_t, make_block
   implicit none
   private
   public :: collect_verdict

contains

   subroutine collect_verdict(tests)
      type(test_case_t), allocatable, intent(out) :: tests(:)

      tests = [ &
         test_case_t("a clean run is good", test_good), &
         test_case_t("what is bad is named", test_bad), &
         test_case_t("a tenth of an edge is a failure", test_deep), &
         test_case_t("what contact gives way by bodies may overlap by", test_give), &
         test_case_t("a balance that is wrong in six digits is a failure", test_balance), &
         test_case_t("round-off of works is no error of the balance", test_rounding), &
         test_case_t("air across which forces act is told, or bad", test_air), &
         test_case_t("linear sections that turn are bad", test_turned), &
         test_case_t("what impacts take is told, of explicit steps bad", test_taken), &
         test_case_t("elements far from the origin keep few digits", test_far), &
         test_case_t("scatter of a comb, of a smooth force, of one push", test_scatter), &
         test_case_t("pulls at single nodes are measured and told", test_pulls), &
         test_case_t("elements that lock are told as it begins", test_locking), &
         test_case_t("a run that failed is not good", test_failed), &
         test_case_t("what pairs can do to need no guards", test_advice)]
   end subroutine collect_verdict

   !> At nu = 0.3 nothing is told, at 0.499 the first element is.
   subroutine test_locking(error)
      type(error_t), allocatable, intent(out) :: error
      real(wp), parameter :: ratio(2) = [0.3_wp, 0.499_wp]
      type(scene_t) :: scene
      type(block_t) :: block
      integer :: k

      do k = 1, 2
         call make_block(scene, "CPE4", [2, 1], block)
         scene%element%label = [10, 20]
         scene%material(1)%constant(2) = ratio(k)
         call add_step(scene, .false., 0.1_wp, 1)
         block
            type(march_t) :: march
            type(verdict_t) :: verdict, fresh

            call march_init(march, scene, error)
            if (.not. allocated(error)) call march_begin_step(march, scene, 1, error)
            if (allocated(error)) return
            call verdict_start(verdict, march)
            call check_equal(error, verdict%n_warning, k - 1, "warnings")
            call check_near(error, verdict%overlap%bar, fresh%overlap%bar, 0.0_wp, 1.0_wp, &
               "no guards give way")
            if (k == 2) call check_true(error, index(verdict%warnings%item(1)%text, &
               "element 10 at nu = 0.499 locks: ") == 1, verdict%warnings%item(1)%text)
            call march_free(march)
         end block
      end do
   end subroutine test_locking

   subroutine test_good(error)
      type(error_t), allocatable, intent(out) :: error
      type(verdict_t) :: verdict

      verdict%energy%largest = 2.0_wp
      verdict%energy%dynamic_error = energy_bar()
      verdict%energy%largest_error = 1.0_wp             ! of statics: shown, not judged
      verdict%n_warning = 3
      call verdict_end(verdict)
      call check_true(error, verdict_is_good(verdict), "good")
      call check_true(error, .not. verdict_is_failure(verdict, .true.), "no failure")
   end subroutine test_good

   subroutine test_bad(error)
      type(error_t), allocatable, intent(out) :: error
      type(verdict_t) :: verdict
      character(len=:), allocatable :: line

      verdict%energy%largest = 2.0_wp
      verdict%energy%dynamic_error = 3.0_wp*energy_bar()
      verdict%unconverged = 1.0e-3_wp
      verdict%overlap%deepest = 1.0e-2_wp
      verdict%law_missed = 1.5_wp
      verdict%largest_push = 3.0_wp
      call verdict_end(verdict)
      call check_equal(error, verdict%reasons%n, 4, "reasons")
      call verdict_line(verdict, line)
      call check_true(error, index(line, "verdict: BAD: ") == 1, line)
      call check_true(error, index(line, "does NOT close") > 0, line)
      call check_true(error, index(line, "friction are violated by 0.5 of") > 0, line)
      call check_true(error, .not. verdict_is_good(verdict), "not good")
      call check_true(error, .not. verdict_is_failure(verdict, .false.), "no failure by itself")
      call check_true(error, verdict_is_failure(verdict, .true.), "a failure if strict")
   end subroutine test_bad

   !> Of a largest energy of 1, by the digits of a real: 4 of 6, 10 of 15, 25 of 33.
   pure real(wp) function energy_bar()
      energy_bar = 1.0e-10_wp
      if (precision(1.0_wp) < 15) energy_bar = 1.0e-4_wp
      if (precision(1.0_wp) > 15) energy_bar = 1.0e-25_wp
   end function energy_bar

   subroutine test_deep(error)
      type(error_t), allocatable, intent(out) :: error
      type(verdict_t) :: verdict

      verdict%overlap%deepest = 0.11_wp
      call verdict_end(verdict)
      call check_true(error, verdict_is_failure(verdict, .false.), "a failure")
   end subroutine test_deep

   !> Bodies may be in each other by what contact gives way by, twice and 0.01 more, and by a tenth
   !> of an edge unless contact itself gives way by more: then that is told, and a failure.
   subroutine test_give(error)
      type(error_t), allocatable, intent(out) :: error
      real(wp), parameter :: give(6) = [0.01_wp, 0.01_wp, 0.09_wp, 0.09_wp, 0.11_wp, 0.11_wp], &
         deepest(6) = [0.029_wp, 0.031_wp, 0.099_wp, 0.101_wp, 0.229_wp, 0.231_wp]
      integer, parameter :: n_reason(6) = [0, 1, 0, 1, 1, 2]
      type(verdict_t) :: verdict
      integer :: k

      do k = 1, size(give)
         verdict = verdict_t()
         verdict%overlap%bar = 0.01_wp
         verdict%overlap%place = "between bodies"
         verdict%overlap%time = 2.5_wp
         verdict%overlap%deepest = deepest(k)
         verdict%penalty%give = give(k)
         call verdict_end(verdict)
         call check_equal(error, verdict%reasons%n, n_reason(k), "reasons")
         call check_true(error, verdict_is_failure(verdict, .false.) .eqv. max(give(k), &
            deepest(k)) > 0.1_wp, "a failure")
      end do
      if (allocated(error)) return
      call check_equal(error, verdict%reasons%item(1)%text, "bodies overlap by 0.231 of an edge " &
         // "at time 2.5, between bodies", "how deep, when and where")
      call check_equal(error, verdict%reasons%item(2)%text, "contact penetrates by up to 0.11 of " &
         // "an edge: STIFFNESS or FACTOR of *CONSTRAINT METHOD is too small", "what gave way")
   end subroutine test_give

   !> One part in a million: nothing to do with round-off in double and more.
   subroutine test_balance(error)
      type(error_t), allocatable, intent(out) :: error
      type(verdict_t) :: verdict
      real(wp) :: failing

      failing = 1.0e-6_wp
      if (precision(1.0_wp) < 15) failing = 1.0e-2_wp
      verdict%energy%largest = 2.0_wp
      verdict%energy%dynamic_error = 1.9_wp*failing
      call verdict_end(verdict)
      call check_true(error, .not. verdict_is_good(verdict), "bad")
      call check_true(error, .not. verdict_is_failure(verdict, .false.), "no failure")
      verdict%energy%dynamic_error = 2.1_wp*failing
      call check_true(error, verdict_is_failure(verdict, .false.), "a failure")
   end subroutine test_balance

   !> At rest there is no energy, and forces have done no work but round-off.
   subroutine test_rounding(error)
      type(error_t), allocatable, intent(out) :: error
      type(verdict_t) :: verdict

      verdict%energy%scale = 3.0_wp
      verdict%energy%largest = tiny(1.0_wp)
      verdict%energy%dynamic_error = 0.9_wp*energy_rounding(verdict%energy)
      verdict%energy%stabilization = verdict%energy%dynamic_error
      call verdict_end(verdict)
      call check_true(error, verdict_is_good(verdict), "good")
      call check_true(error, energy_rounding(verdict%energy) <= 100.0_wp*epsilon(1.0_wp), "small")
      verdict%energy%dynamic_error = 1.1_wp*energy_rounding(verdict%energy)
      call verdict_end(verdict)
      call check_true(error, verdict_is_failure(verdict, .false.), "all of the energy")
   end subroutine test_rounding

   subroutine test_air(error)
      type(error_t), allocatable, intent(out) :: error
      type(verdict_t) :: verdict
      character(len=:), allocatable :: line
      real(wp), parameter :: gap(3) = [0.09_wp, 0.3_wp, 0.51_wp]
      integer, parameter :: n_warning(3) = [0, 1, 0], n_reason(3) = [0, 0, 1]
      integer :: k

      do k = 1, size(gap)
         verdict = verdict_t()
         verdict%stand_off%largest = 10.0_wp     ! of one touch that gives little impulse
         verdict%stand_off%impulse = 4.0_wp
         verdict%stand_off%impulse_gap = 4.0_wp*gap(k)
         call verdict_end(verdict)
         call check_equal(error, verdict%n_warning, n_warning(k), "warnings")
         call check_equal(error, verdict%reasons%n, n_reason(k), "reasons")
      end do
      call verdict_line(verdict, line)
      call check_true(error, index(line, "MASSLESS") > 0, line)
      verdict%has_massless = .true.
      call verdict_end(verdict)
      call verdict_line(verdict, line)
      call check_true(error, index(line, "TYPE=ADMISSIBLE") > 0 &
         .and. index(line, "MASSLESS") == 0, line)
   end subroutine test_air

   subroutine test_turned(error)
      type(error_t), allocatable, intent(out) :: error
      type(verdict_t) :: verdict

      verdict%small%section = [1]
      verdict%small%rotation = [0.19_wp]
      verdict%small%strain = [0.0_wp]
      call verdict_end(verdict)
      call check_true(error, verdict_is_good(verdict), "good")
      verdict%small%rotation = 0.21_wp
      call verdict_end(verdict)
      call check_true(error, .not. verdict_is_good(verdict), "bad")
   end subroutine test_turned

   subroutine test_taken(error)
      type(error_t), allocatable, intent(out) :: error
      type(verdict_t) :: verdict
      real(wp), parameter :: taken(3) = [0.009_wp, 0.04_wp, 0.09_wp]
      integer :: k

      do k = 1, size(taken)
         verdict = verdict_t()
         verdict%energy%largest = 2.0_wp
         verdict%energy%contact_taken = 2.0_wp*taken(k)
         call verdict_end(verdict)
         call check_true(error, verdict_is_good(verdict), "asked for")
         call check_equal(error, verdict%n_warning, merge(0, 1, k == 1), "told")
         verdict%energy%has_explicit = .true.
         verdict%n_warning = 0
         call verdict_end(verdict)
         call check_true(error, verdict_is_good(verdict) .neqv. k == 3, "explicit")
         call check_equal(error, verdict%n_warning, merge(1, 0, k == 2), "told of explicit steps")
      end do
   end subroutine test_taken

   !> Of two triangles the second has an edge of 1/16, of which 1.2 digits fewer are left.
   subroutine test_far(error)
      type(error_t), allocatable, intent(out) :: error
      real(wp) :: x(2, 4), u(2, 4), away
      integer :: element, digits
      integer, parameter :: node(4, 2) = reshape([1, 2, 3, 0, 2, 4, 3, 0], [4, 2])

      x = reshape([0.0_wp, 0.0_wp, 1.0_wp, 0.0_wp, 0.0_wp, 1.0_wp, 1.0_wp, 0.0625_wp], [2, 4])
      u = 0.0_wp
      call far_element_find(x, u, node, element, digits)
      call check_equal(error, [element, digits], [0, 0], "at the origin")
      ! A tenth of the digits that are allowed to be lost, for an edge of 1.
      away = 0.1_wp*(10.0_wp**(-least_digits()))/epsilon(1.0_wp)
      u(2, :) = -away
      call far_element_find(x, u, node, element, digits)
      call check_equal(error, element, 2, "the short edge")
      call check_equal(error, digits, least_digits() - 1, "digits")
   end subroutine test_far

   !> Of distances, in the precision of the build.
   pure integer function least_digits()
      least_digits = 8
      if (precision(1.0_wp) < 15) least_digits = 3
      if (precision(1.0_wp) > 15) least_digits = 16
   end function least_digits

   !> Of forces 2, 0, 2, 0 each is 2 off its neighbours, by a root mean square of sqrt(2). A static
   !> step in between, a rest, a single push and a slow wave are no comb.
   subroutine test_scatter(error)
      type(error_t), allocatable, intent(out) :: error
      type(force_scatter_t) :: comb, wave, push
      integer, parameter :: n = 4000
      integer :: k

      do k = 1, n
         call scatter_follow(comb, pair_sum_t(weight=merge(1.0_wp, 0.0_wp, mod(k, 2) == 1), &
            span=0.5_wp), .true.)
         call scatter_follow(wave, pair_sum_t(weight=1.0_wp + sin(1.2_wp*k), span=1.0_wp), .true.)
         call scatter_follow(push, pair_sum_t(weight=merge(1.0_wp, 0.0_wp, mod(k, 20) == 0), &
            span=1.0_wp), .true.)
      end do
      call check_near(error, scatter_of(comb), sqrt(2.0_wp), 1.0_wp/n, 1.0_wp, "2, 0, 2, 0")
      call check_true(error, scatter_is_comb(comb), "a comb")
      call check_near(error, scatter_of(wave), (1.0_wp - cos(1.2_wp))/sqrt(3.0_wp), 4.0_wp/n, &
         1.0_wp, "a wave of five increments")
      call check_true(error, .not. scatter_is_comb(wave), "no comb")
      call check_true(error, .not. scatter_is_comb(push), "impacts")
      call scatter_follow(push, pair_sum_t(weight=1.0_wp, span=1.0_wp), .false.)
      call check_equal(error, push%n_force, n/20, "statics")
      ! What falls before statics makes no tooth behind them.
      comb = force_scatter_t()
      do k = 1, 4
         call scatter_follow(comb, pair_sum_t(weight=merge(0.0_wp, 1.0_wp, k == 2), span=1.0_wp), &
            k /= 3)
      end do
      call scatter_follow(comb, pair_sum_t(weight=1.0_wp, span=1.0_wp), .true.)
      call check_equal(error, comb%n_dip, 0, "teeth")
      ! One tooth, however long it rises.
      comb = force_scatter_t()
      do k = 1, 6
         call scatter_follow(comb, pair_sum_t(weight=merge(9.0_wp, real(k, wp), k == 1), &
            span=1.0_wp), .true.)
      end do
      call check_equal(error, comb%n_dip, 1, "one tooth")
      ! Nor is anything off its neighbours across statics: squares of both parts add up.
      comb = force_scatter_t()
      wave = force_scatter_t()
      push = force_scatter_t()
      do k = 1, 5
         if (k < 3) call scatter_follow(wave, pair_sum_t(weight=2.0_wp**k, span=1.0_wp), .true.)
         if (k > 3) call scatter_follow(push, pair_sum_t(weight=3.0_wp**k, span=1.0_wp), .true.)
         call scatter_follow(comb, pair_sum_t(weight=merge(2.0_wp, 3.0_wp, k < 3)**k, &
            span=1.0_wp), k /= 3)
      end do
      call check_near(error, comb%off, hypot(wave%off, push%off), 8.0_wp*epsilon(1.0_wp), &
         comb%off, "before statics and behind them")
   end subroutine test_scatter

   subroutine test_failed(error)
      type(error_t), allocatable, intent(out) :: error
      type(verdict_t) :: verdict
      character(len=:), allocatable :: line

      verdict%energy%has_dynamics = .true.
      call verdict_end(verdict, "the analysis stops")
      call check_true(error, .not. verdict_is_good(verdict), "not good")
      call verdict_line(verdict, line)
      call check_equal(error, line, "verdict: NOT COMPLETED", "line")
      call check_equal(error, verdict%message, "the analysis stops", "why")
      call check_true(error, .not. verdict%is_complete, "not complete")
      call verdict_end(verdict)
      call check_equal(error, verdict%message, "", "nothing is left of it")
   end subroutine test_failed

   !> Pairs with integrated gaps take no SIDES=BOTH; those that hold both sides have guards only
   !> where nodes cannot be held; those without guards do not count.
   subroutine test_advice(error)
      type(error_t), allocatable, intent(out) :: error
      type(contact_pair_t) :: one, both, segment, mortar
      character(len=:), allocatable :: advice
      character(len=*), parameter :: mesh = "a finer mesh there", &
         swap = ", the other surface as slave or " // mesh

      both%both_sides = .true.
      both%is_guarded = .false.
      segment%formulation = formulation_segment
      mortar%formulation = formulation_mortar
      call guard_advice([one, both], advice)
      call check_equal(error, advice, "SIDES=BOTH" // swap, "one side")
      call guard_advice([mortar, both], advice)
      call check_equal(error, advice, "TYPE=NODE TO SURFACE" // swap, "integrated")
      call guard_advice([one, segment], advice)
      call check_equal(error, advice, "TYPE=NODE TO SURFACE with SIDES=BOTH" // swap, "either")
      one%is_guarded = .false.
      segment%is_guarded = .false.
      call guard_advice([one, segment, both], advice)
      call check_equal(error, advice, mesh, "both sides")
   end subroutine test_advice

   !> A slave node pushed by 3, against masters of weights -1/6, 5/6 and 1/3: a pull of 1/2. What a
   !> second condition pushes that node with is taken off, what is no mean does not count.
   subroutine test_pulls(error)
      type(error_t), allocatable, intent(out) :: error
      real(wp), parameter :: first(4) = [-1.0_wp, -1.0_wp/6.0_wp, 5.0_wp/6.0_wp, 1.0_wp/3.0_wp], &
         second(4) = [-1.0_wp, 0.1_wp, 0.8_wp, 0.1_wp], normal(2) = [0.6_wp, -0.8_wp]
      type(constraint_set_t) :: set
      type(nodal_pull_t) :: found
      character(len=:), allocatable :: text

      set%n = 2
      allocate(set%item(2))
      set%lam = [3.0_wp, 2.0_wp]
      call fill(set%item(1), [1, 2, 3, 4], first, .true.)
      call fill(set%item(2), [5, 2, 3, 4], second, .false.)
      call nodal_pull_add(found, set, 5)
      call check_near(error, found%pull, 0.5_wp, 8.0_wp*epsilon(1.0_wp), 1.0_wp, "one")
      call check_near(error, found%force, 3.0_wp, 8.0_wp*epsilon(1.0_wp), 1.0_wp, "force")
      call nodal_pull_text(found, text)
      call check_true(error, index(text, "up to 17 %") > 0, "told: " // text)
      set%item(2)%is_mean = .true.
      found = nodal_pull_t()
      call nodal_pull_add(found, set, 5)
      call check_near(error, found%pull, 0.3_wp, 8.0_wp*epsilon(1.0_wp), 1.0_wp, "two")
      call check_near(error, nodal_pull_share(found), 0.3_wp/4.1_wp, 8.0_wp*epsilon(1.0_wp), &
         1.0_wp, "share")
      ! What pulls pulls at the slave node by all of it.
      set%lam(1) = -3.0_wp
      set%item(2)%is_mean = .false.
      found = nodal_pull_t()
      call nodal_pull_add(found, set, 5)
      call check_near(error, found%pull, 3.0_wp, 8.0_wp*epsilon(1.0_wp), 1.0_wp, "a pull")
      set%n_permanent = 1
      set%item(2)%is_mean = .true.
      found = nodal_pull_t()
      call nodal_pull_add(found, set, 5)
      call nodal_pull_text(found, text)
      call check_true(error, .not. found%pull > 0.0_wp .and. text == "", "pushes alone")

   contains

      subroutine fill(item, node, weight, is_mean)
         type(condition_t), intent(inout) :: item
         integer, intent(in) :: node(:)
         real(wp), intent(in) :: weight(:)
         logical, intent(in) :: is_mean

         item%n_node = size(node)
         item%n_slave = 1
         item%node = node
         item%g = spread(normal, 2, size(node))*spread(weight, 1, 2)
         item%is_mean = is_mean
      end subroutine fill

   end subroutine test_pulls

end module test_verdict
