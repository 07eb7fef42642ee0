!> Slips of contact in space over meshes, of nodes and of mortar, and of mortar on walls:
!> identities, momenta, rigid motions, a block that slides, derivatives.
module test_contact_slips_space
   use box_contacts, only : draw_meshes => draw, draw_on_wall, evaluate, kind, look, make_boxes, &
      seen, sum_up
   use check, only : check_near, check_true, test_case_t
   use emcon_constraint, only : condition_normal, condition_stiffness, condition_t
   use emcon_contact, only : contact_t
   use emcon_contact_registry, only : new_contact
   use emcon_errors, only : error_t
   use emcon_interactions, only : contact_pair_t, formulation_mortar, formulation_nts
   use emcon_kinds, only : wp
   use emcon_scene, only : scene_t
   use emcon_text, only : to_text
   use random_draws, only : draw_random
   implicit none
   private
   public :: collect_contact_slips_space

   real(wp), parameter :: eps = epsilon(1.0_wp)
   !> Some hundred roundings, of places by the least part of a vertex that is covered here, 1/50.
   real(wp), parameter :: tol = 1.0e4_wp*eps
   integer, parameter :: formulation(2) = [formulation_nts, formulation_mortar]

contains

   subroutine collect_contact_slips_space(tests)
      type(test_case_t), allocatable, intent(out) :: tests(:)

      tests = [ &
         test_case_t("identity and momenta", test_identity), &
         test_case_t("rigid motions are no slip", test_rigid), &
         test_case_t("a block that slides slips by its way", test_slide), &
         test_case_t("derivatives against differences", test_derivatives), &
         test_case_t("at the end of a step, against differences", test_at_end)]
   end subroutine collect_contact_slips_space

   !> Two of three draws are meshes, and one is a wall.
   subroutine draw(k, size_of, scene, du, contact, error)
      integer, intent(in) :: k
      real(wp), intent(in) :: size_of
      type(scene_t), intent(out) :: scene
      real(wp), allocatable, intent(out) :: du(:, :)
      class(contact_t), allocatable, intent(out) :: contact
      type(error_t), allocatable, intent(out) :: error

      if (mod(k, 3) == 0) then
         call draw_on_wall(k/3, size_of, scene, du, contact, error)
      else
         call draw_meshes(k, size_of, scene, du, contact, error)
      end if
   end subroutine draw

   !> Forces along slips do the work of friction on them, and have neither resultant nor moment.
   subroutine test_identity(error)
      type(error_t), allocatable, intent(out) :: error
      type(scene_t) :: scene
      class(contact_t), allocatable :: contact
      type(condition_t), allocatable :: item(:)
      real(wp), allocatable :: du(:, :)
      real(wp) :: work, sums(6), magnitude
      integer :: i, k, s

      do k = 1, 36
         call draw(k, 0.3_wp*0.09_wp**(k/6), scene, du, contact, error)
         if (allocated(error)) return
         call look(contact, scene, du)
         associate (wanted => seen(contact))
            call evaluate(contact, scene, du, .true., wanted, item, .true.)
            call check_true(error, size(item) > 2, "nodes are over it")
            do i = 1, size(item)
               associate (slip => contact%slip(wanted(i), scene%x, scene%u0, du))
                  call check_near(error, slip, item(i)%slip, tol, maxval(abs(du)), "slip")
               end associate
               do s = 1, 2
                  associate (nodes => item(i)%n_node)
                     call sum_up(scene, du, item(i)%node(:nodes), item(i)%t(:, :nodes, s), work, &
                        sums, magnitude)
                  end associate
                  call check_near(error, work, item(i)%slip(s), tol, magnitude*maxval(abs(du)), &
                     "identity " // to_text(k))
                  call check_near(error, sums, 0.0_wp*sums, tol, magnitude, &
                     "momenta " // to_text(k))
               end do
            end do
         end associate
      end do
   end subroutine test_identity

   !> All turn together, by up to half a turn.
   subroutine test_rigid(error)
      type(error_t), allocatable, intent(out) :: error
      type(scene_t) :: scene
      class(contact_t), allocatable :: contact
      real(wp), allocatable :: du(:, :)
      real(wp) :: turn(3, 3), angle
      integer :: i, k

      do k = 1, 12
         call draw(k, 0.1_wp, scene, du, contact, error)
         if (allocated(error)) return
         call look(contact, scene, du)
         angle = 0.35_wp*real(k, wp)
         turn = 0.0_wp
         turn(1, 1:2) = [cos(angle), -sin(angle)]
         turn(2, 1:2) = [sin(angle), cos(angle)]
         turn(3, 3) = 1.0_wp
         turn = turn([1, 3, 2], [1, 3, 2])
         associate (at => scene%x + scene%u0)
            du = matmul(turn, at) - at + 0.3_wp
         end associate
         do i = 1, contact%n_constraint
            if (contact%state(i)%is_near) call check_near(error, contact%slip(i, scene%x, &
               scene%u0, &
               du), [0.0_wp, 0.0_wp], tol, 1.0_wp, to_text(k) // " " // to_text(i))
         end do
      end do
   end subroutine test_rigid

   !> Over a flat surface, over some of its facets and partly past its end, turned as a whole: each
   !> vertex slips by the way in length, and a push presses with what friction acts with.
   subroutine test_slide(error)
      type(error_t), allocatable, intent(out) :: error
      real(wp), parameter :: way(2) = [0.35_wp, 0.2_wp]
      type(scene_t) :: scene
      type(contact_pair_t) :: pair
      class(contact_t), allocatable :: contact
      type(condition_t), allocatable :: item(:)
      real(wp), allocatable :: du(:, :)
      integer :: i, k

      do k = 1, 4
         call make_boxes(kind(1 + mod(k, 2)), 0.0_wp, [0.1_wp, 0.07_wp], 0.7_wp, scene, pair)
         pair%interaction%friction = 0.3_wp
         pair%formulation = formulation(merge(1, 2, k <= 2))
         call new_contact(scene, pair, contact, error)
         if (allocated(error)) return
         call contact%suit_steps(.false.)
         du = 0.0_wp*scene%x
         du(:2, :64) = spread(way, 2, 64)
         call look(contact, scene, du)
         associate (wanted => pack([(i, i = 1, contact%n_constraint)], contact%state%is_over &
               .and. .not. contact%state%is_arriving .and. abs(contact%state%gap0) < 0.01_wp))
            call evaluate(contact, scene, du, .true., wanted, item, .true.)
            call check_true(error, size(item) > 5, "nodes are over it")
            do i = 1, size(item)
               call check_near(error, norm2(item(i)%slip), norm2(way), tol, 1.0_wp, to_text(k) // &
                  " slip of " // to_text(i))
               call check_near(error, norm2(sum(item(i)%g(:, :item(i)%n_slave), 2)), &
                  condition_normal(item(i)), tol, 1.0_wp, to_text(k) // " push of " // to_text(i))
            end do
         end associate
      end do
   end subroutine test_slide

   !> Central differences err by the square of their way, beside round-off by it. Where friction acts
   !> at the end of the step, slip is measured there; `test_at_end` has its forces.
   subroutine test_derivatives(error)
      type(error_t), allocatable, intent(out) :: error
      type(scene_t) :: scene
      class(contact_t), allocatable :: contact
      type(condition_t), allocatable :: item(:), up(:), down(:)
      real(wp), allocatable :: du(:, :), way(:, :)
      real(wp) :: step, bound
      integer :: i, k, n, s, n_seen

      step = eps**(1.0_wp/3.0_wp)
      bound = 1.0e3_wp*step**2
      n_seen = 0
      do k = 1, 24
         call draw(k, 0.1_wp, scene, du, contact, error)
         if (allocated(error)) return
         contact%step%pushes_at_end = k > 12
         call look(contact, scene, du)
         way = 0.0_wp*du
         call draw_random(way)
         way = 2.0_wp*way - 1.0_wp
         call evaluate(contact, scene, du, .false., seen(contact), item, .true.)
         call evaluate(contact, scene, du + step*way, .true., seen(contact), up, .true.)
         call evaluate(contact, scene, du - step*way, .true., seen(contact), down, .true.)
         do i = 1, size(item)
            n = item(i)%n_node
            if (n /= up(i)%n_node .or. n /= down(i)%n_node) cycle
            if (any(item(i)%node(:n) /= up(i)%node(:n))) cycle
            n_seen = n_seen + 1
            associate (by => reshape(way(:, item(i)%node(:n)), [3*n]))
               do s = 1, 2
                  call check_near(error, dot_product(reshape(item(i)%t1(:, :n, s), [3*n]), by), &
                     (up(i)%slip(s) - down(i)%slip(s))/(2.0_wp*step), bound, 1.0_wp, "gradient")
                  if (k > 12) cycle
                  call check_near(error, matmul(item(i)%ht(:3*n, :3*n, s), by), &
                     reshape((up(i)%t(:, &
                     :n, s) - down(i)%t(:, :n, s))/(2.0_wp*step), [3*n]), bound, &
                     max(1.0_wp, maxval(abs(item(i)%ht(:3*n, :3*n, s)))), "second derivative")
               end do
            end associate
         end do
      end do
      call check_true(error, n_seen > 80, "conditions on the same nodes")
   end subroutine test_derivatives

   !> Friction that acts by the end of a step alone: directions and lengths are those there, and
   !> move with it, as the normal force does that friction is in proportion to. Second derivatives
   !> are by one end of a motion, of two; third ones are as large as squares of these.
   subroutine test_at_end(error)
      type(error_t), allocatable, intent(out) :: error
      type(scene_t) :: scene
      class(contact_t), allocatable :: contact
      type(condition_t), allocatable :: item(:), up(:), down(:)
      real(wp), allocatable :: du(:, :), way(:, :)
      real(wp) :: step, bound
      integer :: i, k, n, n_seen
      real(wp), parameter :: push = 0.7_wp, friction(2) = [0.3_wp, -0.2_wp]

      step = eps**(1.0_wp/3.0_wp)
      bound = 1.0e3_wp*step**2
      n_seen = 0
      do k = 1, 12
         call draw(k, 0.1_wp, scene, du, contact, error)
         if (allocated(error)) return
         contact%step%pushes_at_end = .true.
         call look(contact, scene, du)
         way = 0.0_wp*du
         call draw_random(way)
         way = 2.0_wp*way - 1.0_wp
         call evaluate_at(0.0_wp, .false., item)
         call evaluate_at(step, .true., up)
         call evaluate_at(-step, .true., down)
         do i = 1, size(item)
            n = item(i)%n_node
            if (n /= up(i)%n_node .or. n /= down(i)%n_node) cycle
            if (any(item(i)%node(:n) /= up(i)%node(:n))) cycle
            n_seen = n_seen + 1
            item(i)%h = 2.0_wp*item(i)%h
            item(i)%ht = 2.0_wp*item(i)%ht
            item(i)%normal = condition_normal(item(i))
            item(i)%response%stick = item(i)%normal*friction
            associate (by => reshape(way(:, item(i)%node(:n)), [3*n]))
               call check_near(error, -matmul(condition_stiffness(item(i), push, .true.), by), &
                  (force_of(up(i)) - force_of(down(i)))/(2.0_wp*step), bound, max(1.0_wp, &
                  maxval(abs(item(i)%ht(:3*n, :3*n, :))), maxval(abs(item(i)%h(:3*n, :3*n))))**2, &
                  "stiffness " // to_text(k))
            end associate
         end do
      end do
      call check_true(error, n_seen > 40, "conditions on the same nodes")

   contains

      !> At the end of the step and a part of `way`.
      subroutine evaluate_at(part, leaves_second, item)
         real(wp), intent(in) :: part
         logical, intent(in) :: leaves_second
         type(condition_t), allocatable, intent(out) :: item(:)
         type(scene_t) :: moved

         moved = scene
         moved%u0 = scene%u0 + du + part*way
         call evaluate(contact, moved, 0.0_wp*du, leaves_second, seen(contact), item, .true.)
      end subroutine evaluate_at

      !> What a push and friction in proportion to it are on all nodes.
      function force_of(item) result(force)
         type(condition_t), intent(in) :: item
         real(wp) :: force(3*item%n_node)

         associate (n => item%n_node)
            force = push*reshape(item%g(:, :n), [3*n]) - condition_normal(item)*reshape( &
               friction(1)*item%t(:, :n, 1) + friction(2)*item%t(:, :n, 2), [3*n])
         end associate
      end function force_of

   end subroutine test_at_end

end module test_contact_slips_space
