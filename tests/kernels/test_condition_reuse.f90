!> Conditions of each way to measure: the same whatever stood there before, and their derivatives.
module test_condition_reuse
   use check, only : check_equal, check_near, check_true, test_case_t
   use emcon_constraint, only : condition_t
   use emcon_contact, only : contact_t
   use emcon_contact_registry, only : new_contact
   use emcon_errors, only : error_t
   use emcon_interactions, only : contact_options_t, formulation_mortar, formulation_nts, &
      formulation_segment, multiplier_dual, multiplier_standard, smoothing_hermite, smoothing_none
   use emcon_kinds, only : wp
   use emcon_scene, only : scene_t
   use emcon_text, only : to_text
   use ring_scenes, only : make_rings
   use small_scenes, only : shake
   implicit none
   private
   public :: collect_condition_reuse

   !> What stands in a condition before.
   real(wp), parameter :: rubbish = 1.0e10_wp
   !> Ways to measure: nodes, smoothed, segments, mortar with dual multipliers or not.
   integer, parameter :: n_way = 5
   real(wp), parameter :: tol = 256.0_wp*epsilon(1.0_wp)
   !> Differences, and what central ones leave, by second derivatives.
   real(wp), parameter :: step = 0.125_wp*epsilon(1.0_wp)**(1.0_wp/3.0_wp), &
      rest = 1.0e5_wp*epsilon(1.0_wp)**(2.0_wp/3.0_wp)
   integer, parameter :: most_nodes = 32

   type :: case_t
      type(scene_t) :: scene
      class(contact_t), allocatable :: contact
      real(wp), allocatable :: du(:, :)          !! (n_dim, n_node) [L]
   end type case_t

contains

   subroutine collect_condition_reuse(tests)
      type(test_case_t), allocatable, intent(out) :: tests(:)

      tests = [ &
         test_case_t("whatever stood there, and with fewer derivatives", test_same), &
         test_case_t("derivatives against differences", test_derivatives)]
   end subroutine collect_condition_reuse

   !> A hub in a sleeve that is larger by a little, and its contact over a motion.
   subroutine make(case, way, is_reversed, rubs, error)
      type(case_t), intent(out) :: case
      integer, intent(in) :: way                 !! 1 to n_way
      logical, intent(in) :: is_reversed, rubs
      type(error_t), allocatable, intent(out) :: error
      type(contact_options_t) :: options

      call make_rings(case%scene, [7, 10], 0.01_wp, is_reversed)
      associate (scene => case%scene)
         scene%pair(1)%formulation = merge(formulation_mortar, merge(formulation_segment, &
            formulation_nts, way == 3), way > 3)
         if (rubs) scene%pair(1)%interaction%friction = 0.3_wp
         options%smoothing = merge(smoothing_hermite, smoothing_none, way == 2)
         options%multiplier = merge(multiplier_standard, multiplier_dual, way == 5)
         call new_contact(scene, scene%pair(1), case%contact, error)
         if (allocated(error)) return
         case%du = 0.0_wp*scene%x
         call shake(case%du, 0.01_wp)
         call case%contact%suit_steps(.false.)
         call case%contact%configure(scene%x, options)
         call case%contact%begin_step(scene%x, scene%u0, case%du)
         call case%contact%measure(scene%x, scene%u0, case%du)
      end associate
   end subroutine make

   !> Condition `i`, over the motion or over one that ends elsewhere.
   subroutine evaluate(case, i, item, further)
      type(case_t), intent(inout) :: case
      integer, intent(in) :: i
      type(condition_t), intent(inout) :: item
      real(wp), intent(in), optional :: further(:, :)      !! (n_dim, n_node) [L]
      type(condition_t) :: one(1)
      real(wp) :: du(2, size(case%du, 2))

      du = case%du
      if (present(further)) du = du + further
      one(1) = item
      call case%contact%evaluate([i], case%scene%x, case%scene%u0, du, [0.125_wp], one)
      item = one(1)
   end subroutine evaluate

   !> Whatever stood in the condition, and with second derivatives or without, it is the same.
   subroutine test_same(error)
      type(error_t), allocatable, intent(out) :: error
      type(case_t) :: case
      type(condition_t) :: fresh, used
      integer :: k, i, n_seen

      do k = 0, 4*n_way - 1
         call make(case, 1 + k/4, mod(k, 2) == 1, mod(k/2, 2) == 1, error)
         if (allocated(error)) return
         n_seen = 0
         do i = 1, case%contact%n_constraint
            if (.not. all([case%contact%state(i)%is_near, case%contact%state(i)%is_over])) cycle
            n_seen = n_seen + 1
            fresh = condition_t(has_friction=mod(k/2, 2) == 1)
            call evaluate(case, i, fresh)
            used = fresh
            call spoil(used)
            call evaluate(case, i, used)
            call check_same(error, used, fresh, "used before, way " // to_text(1 + k/4))
            used = condition_t(has_friction=fresh%has_friction, leaves_second=.true.)
            call evaluate(case, i, used)
            call check_same(error, used, fresh, "first derivatives, way " // to_text(1 + k/4))
            if (allocated(error)) return
         end do
         call check_true(error, n_seen > 2, "conditions")
      end do
   end subroutine test_same

   subroutine check_same(error, used, fresh, what)
      type(error_t), allocatable, intent(inout) :: error
      type(condition_t), intent(in) :: used, fresh
      character(len=*), intent(in) :: what

      associate (n => fresh%n_node, m => 2*fresh%n_node)
         call check_equal(error, [used%n_node, used%n_slave, used%node(:n)], [n, fresh%n_slave, &
            fresh%node(:n)], what // ": nodes")
         call check_near(error, [used%gap0, used%gap1, used%dgap], [fresh%gap0, &
            fresh%gap1, fresh%dgap], tol, 1.0_wp, what // ": gaps")
         call check_near(error, used%g(:, :n), fresh%g(:, :n), tol, 1.0_wp, what // ": g")
         call check_near(error, used%c(:, :n), fresh%c(:, :n), tol, 1.0_wp, what // ": c")
         if (.not. used%leaves_second) call check_near(error, used%h(:m, :m), fresh%h(:m, :m), &
            tol, 1.0_wp, what // ": h")
         if (.not. fresh%has_friction) return
         call check_near(error, used%slip(1), fresh%slip(1), tol, 1.0_wp, what // ": slip")
         call check_near(error, used%t(:, :n, 1), fresh%t(:, :n, 1), tol, 1.0_wp, what // ": t")
         call check_near(error, used%t1(:, :n, 1), fresh%t1(:, :n, 1), tol, 1.0_wp, what // ": t1")
         if (.not. used%leaves_second) call check_near(error, used%ht(:m, :m, 1), &
            fresh%ht(:m, :m, 1), tol, 1.0_wp, what // ": ht")
      end associate
   end subroutine check_same

   !> Put rubbish into all that an evaluation is to say.
   pure subroutine spoil(item)
      type(condition_t), intent(inout) :: item

      item%node = -1
      item%n_slave = -1
      item%gap0 = rubbish
      item%gap1 = rubbish
      item%dgap = rubbish
      item%g = rubbish
      item%c = rubbish
      item%h = rubbish
      item%slip = rubbish
      if (.not. allocated(item%t)) return
      item%t = rubbish
      item%t1 = rubbish
      item%ht = rubbish
   end subroutine spoil

   !> The gap changes by its discrete gradient times the way, slip is that of its own; differences
   !> of both are their derivatives, and those of the gap at the end are the gradient there.
   subroutine test_derivatives(error)
      type(error_t), allocatable, intent(out) :: error
      type(case_t) :: case
      type(condition_t) :: item, after, before
      real(wp), allocatable :: move(:, :)
      real(wp) :: way(2*most_nodes)
      integer :: k, i, j

      do k = 0, 2*n_way - 1
         call make(case, 1 + k/2, mod(k, 2) == 1, .true., error)
         if (allocated(error)) return
         move = case%du
         call shake(move, step)
         do i = 1, case%contact%n_constraint
            if (.not. all([case%contact%state(i)%is_near, case%contact%state(i)%is_over])) cycle
            item = condition_t(has_friction=.true.)
            before = item
            after = item
            call evaluate(case, i, item)
            call evaluate(case, i, before, -move)
            call evaluate(case, i, after, move)
            associate (n => item%n_node, m => 2*item%n_node, du => case%du)
               do j = 1, n
                  way(2*j - 1:2*j) = move(:, item%node(j))
               end do
               call check_near(error, [item%dgap, item%slip(1)], [sum(item%g(:, :n) &
                  *du(:, item%node(:n))), sum(item%t(:, :n, 1)*du(:, item%node(:n)))], tol, &
                  1.0_wp, "ways of gap and slip, way " // to_text(1 + k/2))
               call check_near(error, after%gap1 - before%gap1, 2.0_wp*sum(item%c(:, :n) &
                  *reshape(way(:m), [2, n])), rest, step, "gradient, way " // to_text(1 + k/2))
               call check_near(error, reshape(after%g(:, :n) - before%g(:, :n), [m]), &
                  2.0_wp*matmul(item%h(:m, :m), way(:m)), rest, step*(1.0_wp &
                  + maxval(abs(item%h(:m, :m)))), "h, way " // to_text(1 + k/2))
               call check_near(error, reshape(after%t(:, :n, 1) - before%t(:, :n, 1), [m]), &
                  2.0_wp*matmul(item%ht(:m, :m, 1), way(:m)), rest, step*(1.0_wp &
                  + maxval(abs(item%ht(:m, :m, 1)))), "ht, way " // to_text(1 + k/2))
            end associate
            if (allocated(error)) return
         end do
      end do
   end subroutine test_derivatives

end module test_condition_reuse
