!> Contact of all formulations in other units, far away and turned by a right angle: lengths are
!> multiplied, vectors turned, and nothing else changes but by round-off.
module test_contact_scales
   use check, only : check_equal, check_near, check_true, test_case_t
   use emcon_constraint, only : condition_t
   use emcon_contact, only : contact_t
   use emcon_contact_registry, only : new_contact
   use emcon_errors, only : error_t
   use emcon_interactions, only : contact_options_t, formulation_mortar, formulation_nts, &
      formulation_segment, integration_elements, integration_segments, interaction_t, &
      multiplier_dual, multiplier_standard, normal_edge, normal_nodal, smoothing_hermite, &
      smoothing_none
   use emcon_kinds, only : wp
   use emcon_scene, only : scene_t
   use emcon_text, only : to_text
   use ring_scenes, only : make_rings
   use small_scenes, only : block_t, make_two_blocks, shake
   implicit none
   private
   public :: collect_contact_scales

   integer, parameter :: n_variant = 24
   real(wp), parameter :: scale = 1.0_wp/64.0_wp, target = 0.125_wp

   real(wp), parameter :: tol = 1024.0_wp*epsilon(1.0_wp), far = 1.0e6_wp

   !> Displacements are multiples of `grid` up to 4: so far away they are still exact.
   real(wp), parameter :: grid = 2.0_wp**(-20), away = 2.0_wp**(digits(1.0_wp) - 23)

   !> A contact and what it told of a step.
   type :: told_t
      class(contact_t), allocatable :: contact
      real(wp), allocatable :: slip(:, :), area(:), length(:), own(:), share(:), mean(:)
      logical, allocatable :: covers(:)
      type(condition_t), allocatable :: item(:)
   end type told_t

contains

   subroutine collect_contact_scales(tests)
      type(test_case_t), allocatable, intent(out) :: tests(:)

      tests = [ &
         test_case_t("blocks that slide", test_blocks), &
         test_case_t("blocks that leave, and come", test_ends), &
         test_case_t("arcs of rings", test_arcs)]
   end subroutine collect_contact_scales

   !> Options by the bits of `k`, 0 to 23.
   pure subroutine choose(k, formulation, options)
      integer, intent(in) :: k
      integer, intent(out) :: formulation
      type(contact_options_t), intent(out) :: options

      formulation = formulation_mortar
      if (k > 15) formulation = formulation_nts
      if (k > 19) formulation = formulation_segment
      options%smoothing = merge(smoothing_hermite, smoothing_none, btest(k, 0))
      options%multiplier = merge(multiplier_dual, multiplier_standard, btest(k, 1))
      options%normal = merge(normal_edge, normal_nodal, btest(k, 2))
      options%integration = merge(integration_elements, integration_segments, btest(k, 3))
   end subroutine choose

   !> (x, y) to `by` (-y, x); as it is for 1.
   pure function turned(x, by)
      real(wp), intent(in) :: x(:, :), by
      real(wp) :: turned(2, size(x, 2))

      turned = x
      if (abs(by - 1.0_wp) <= 0.0_wp) return
      turned(1, :) = -by*x(2, :)
      turned(2, :) = by*x(1, :)
   end function turned

   elemental real(wp) function on_grid(u)
      real(wp), intent(in) :: u

      on_grid = grid*nint(u/grid)
   end function on_grid

   !> One step of variant `k` of the contact of `scene` with all lengths by `by`.
   subroutine tell(scene, k, u, du, by, told, error)
      type(scene_t), intent(in) :: scene
      integer, intent(in) :: k
      real(wp), intent(in) :: u(:, :), du(:, :), by
      type(told_t), intent(out) :: told
      type(error_t), allocatable, intent(out) :: error
      type(scene_t) :: own
      type(contact_options_t) :: options
      real(wp), dimension(2, size(u, 2)) :: x, u0, d
      integer :: i, n

      own = scene
      x = turned(scene%x, by)
      u0 = turned(on_grid(u), by)
      if (by < 1.0_wp) u0 = u0 + by*away
      d = turned(on_grid(du), by)
      own%x = x
      own%u0 = u0
      call choose(k, own%pair(1)%formulation, options)
      own%pair(1)%interaction = interaction_t(offset=by/32.0_wp, friction=0.5_wp)
      call new_contact(own, own%pair(1), told%contact, error)
      if (allocated(error)) return
      associate (contact => told%contact)
         call contact%suit_steps(btest(k, 1))
         call contact%configure(x, options)
         call contact%follow_arcs(x, options, btest(k, 1))
         call contact%begin_step(x, u0, d)
         call contact%measure(x, u0, d)
         n = contact%n_constraint
         told%slip = reshape([(contact%slip(i, x, u0, d), i = 1, n)], [1, n])
         told%covers = [(contact%covers(i, x, u0, d), i = 1, n)]
         allocate(told%area(n), told%length(n), told%own(n), told%item(n))
         call contact%own_area(x, told%own)
         call contact%area(x, u0 + d, told%area, told%length)
         told%share = [(contact%share(i), i = 1, n)]
         told%mean = [(contact%mean_gap(i, by), i = 1, n)]
         told%item%has_friction = .true.
         do i = 1, n
            if (.not. (contact%state(i)%is_near .and. contact%state(i)%is_over)) cycle
            call contact%evaluate([i], x, u0, d, [by*target], told%item(i:i))
         end do
      end associate
   end subroutine tell

   !> A condition is that of the gap that is measured, and of the slip that is told.
   subroutine check_conditions(error, told, name)
      type(error_t), allocatable, intent(inout) :: error
      type(told_t), intent(in) :: told
      character(len=*), intent(in) :: name
      integer :: i

      do i = 1, size(told%item)
         if (told%item(i)%n_node == 0) cycle
         associate (state => told%contact%state(i), item => told%item(i))
            call check_near(error, told%contact%mean_gap(i, item%gap1), state%gap1 - target, tol, &
               1.0_wp, "gap at the end, " // name)
            if (.not. state%is_arriving) call check_near(error, item%gap0, state%gap0 - target, &
               tol, 1.0_wp, "gap at the start, " // name)
            call check_near(error, item%slip(1), told%slip(1, i), tol, 1.0_wp, "slip, " // name)
            call check_near(error, item%size, state%size, tol, 1.0_wp, "size, " // name)
         end associate
      end do
   end subroutine check_conditions

   !> What is told in other units is the same.
   subroutine compare(error, one, other, name)
      type(error_t), allocatable, intent(inout) :: error
      type(told_t), intent(in) :: one, other
      character(len=*), intent(in) :: name
      integer :: i

      associate (a => one%contact%state, b => other%contact%state)
         call check_near(error, [b%gap0, b%gap1, b%size, min(b%other_size, far*scale), &
            b%closed], scale*[a%gap0, a%gap1, a%size, min(a%other_size, far), a%closed], tol, &
            scale, "lengths, " // name)
         call check_near(error, b%slip_shift, a%slip_shift, tol, 1.0_wp, "shares, " // name)
         call check_true(error, all([b%is_near .eqv. a%is_near, b%is_over .eqv. a%is_over, &
            b%is_arriving .eqv. a%is_arriving, b%was_open .eqv. a%was_open, b%is_leaving .eqv. &
            a%is_leaving, b%is_covered .eqv. a%is_covered, one%covers .eqv. other%covers]), &
            "what it is, " // name)
      end associate
      call check_near(error, [other%slip, other%contact%sagitta, [other%contact%rounding*scale]], &
         scale*[one%slip, one%contact%sagitta, [one%contact%rounding]], tol, scale, "slips, " &
         // name)
      ! By boxes, where the surfaces are.
      call check_near(error, [other%contact%reach, other%contact%clearance], &
         scale*[one%contact%reach, one%contact%clearance], tol*away, scale, "reach, " // name)
      call check_near(error, [other%area, other%length, other%own, other%mean], scale*[one%area, &
         one%length, one%own, one%mean], tol, scale, "areas, " // name)
      call check_near(error, other%share, one%share, tol, 1.0_wp, "parts, " // name)
      do i = 1, size(one%item)
         call compare_items(error, one%item(i), other%item(i), name // ", " // to_text(i))
         if (allocated(error)) return
      end do
   end subroutine compare

   subroutine compare_items(error, one, other, name)
      type(error_t), allocatable, intent(inout) :: error
      type(condition_t), intent(in) :: one, other
      character(len=*), intent(in) :: name
      integer :: n

      n = one%n_node
      call check_equal(error, [other%n_node, other%n_slave], [n, one%n_slave], "nodes, " // name)
      if (n == 0) return
      call check_equal(error, other%node(:n), one%node(:n), "nodes, " // name)
      if (allocated(error)) return
      call check_near(error, [other%gap0, other%gap1, other%dgap, other%size, other%slip], &
         scale*[one%gap0, one%gap1, one%dgap, one%size, one%slip], tol, scale, "values, " &
         // name)
      call check_near(error, other%g(:, :n), way_of(one%g), tol, 1.0_wp, "discrete gradient, " &
         // name)
      call check_near(error, other%c(:, :n), way_of(one%c), tol, 1.0_wp, "gradient, " // name)
      call check_near(error, other%t(:, :n, 1), way_of(one%t(:, :, 1)), tol, 1.0_wp, &
         "along the surface, " // name)
      call check_near(error, other%t1(:, :n, 1), way_of(one%t1(:, :, 1)), tol, 1.0_wp, &
         "of slip, " // name)
      call check_near(error, scale*other%h(:2*n, :2*n), pairs_of(one%h), tol, &
         maxval(abs(one%h(:2*n, :2*n))), "second derivatives, " // name)
      call check_near(error, scale*other%ht(:2*n, :2*n, 1), pairs_of(one%ht(:, :, 1)), tol, &
         maxval(abs(one%ht(:2*n, :2*n, 1))), "second ones along the surface, " // name)

   contains

      !> Vectors turned.
      pure function way_of(g) result(way)
         real(wp), intent(in) :: g(:, :)
         real(wp) :: way(2, n)

         way(1, :) = -g(2, :n)
         way(2, :) = g(1, :n)
      end function way_of

      !> Both indices turned.
      pure function pairs_of(h) result(pairs)
         real(wp), intent(in) :: h(:, :)
         real(wp) :: pairs(2*n, 2*n), half(2*n, 2*n)

         half(1::2, :) = -h(2:2*n:2, :2*n)
         half(2::2, :) = h(1:2*n:2, :2*n)
         pairs(:, 1::2) = -half(:, 2::2)
         pairs(:, 2::2) = half(:, 1::2)
      end function pairs_of

   end subroutine compare_items

   !> All variants of a step of `scene`, in all units.
   subroutine try(scene, u, du, name, error)
      type(scene_t), intent(in) :: scene
      real(wp), intent(in) :: u(:, :), du(:, :)
      character(len=*), intent(in) :: name
      type(error_t), allocatable, intent(inout) :: error
      type(error_t), allocatable :: failure
      type(told_t) :: one, other
      integer :: k

      do k = 0, n_variant - 1
         call tell(scene, k, u, du, 1.0_wp, one, failure)
         if (.not. allocated(failure)) call tell(scene, k, u, du, scale, other, failure)
         if (allocated(failure)) then
            error = failure
            return
         end if
         call check_conditions(error, one, name // ", variant " // to_text(k))
         call compare(error, one, other, name // ", variant " // to_text(k))
         if (allocated(error)) return
      end do
   end subroutine try

   subroutine test_blocks(error)
      type(error_t), allocatable, intent(out) :: error
      type(scene_t) :: scene
      type(block_t) :: lower, upper
      real(wp), allocatable :: u(:, :), du(:, :)

      call make_two_blocks(scene, 0.25_wp, lower, upper)
      allocate(u, du, source=0.0_wp*scene%x)
      call shake(u, 0.1_wp)
      call shake(du, 0.2_wp)
      call try(scene, u, du, "blocks", error)
   end subroutine test_blocks

   !> The slave's edge half over the end of the master, or past it, before or after the step.
   subroutine test_ends(error)
      type(error_t), allocatable, intent(out) :: error
      real(wp), parameter :: place(2, 4) = reshape([1.4_wp, 2.5_wp, 2.5_wp, 1.4_wp, 2.1_wp, &
         2.2_wp, -2.1_wp, -2.5_wp], [2, 4])
      type(scene_t) :: scene
      type(block_t) :: lower, upper
      real(wp), allocatable :: u(:, :), du(:, :)
      integer :: case

      do case = 1, 4
         call make_two_blocks(scene, merge(0.25_wp, -0.125_wp, mod(case, 2) == 0), lower, upper)
         allocate(u, du, source=0.0_wp*scene%x)
         call shake(u, 0.02_wp)
         call shake(du, 0.02_wp)
         associate (way => place(:, 1 + mod(case - 1, 4)))
            u(1, 11:) = u(1, 11:) + way(1) - scene%x(1, 11)
            du(1, 11:) = du(1, 11:) + way(2) - way(1)
         end associate
         call try(scene, u, du, "case " // to_text(case), error)
         if (allocated(error)) return
         deallocate(u, du)
      end do
   end subroutine test_ends

   subroutine test_arcs(error)
      type(error_t), allocatable, intent(out) :: error
      type(scene_t) :: scene
      real(wp), allocatable :: u(:, :), du(:, :)
      integer :: side

      do side = 1, 2
         call make_rings(scene, [7, 10], 0.01_wp, side == 2)
         allocate(u, du, source=0.0_wp*scene%x)
         call shake(u, 0.01_wp)
         call shake(du, 0.01_wp)
         call try(scene, u, du, "side " // to_text(side), error)
         if (allocated(error)) return
         deallocate(u, du)
      end do
   end subroutine test_arcs

end module test_contact_scales
