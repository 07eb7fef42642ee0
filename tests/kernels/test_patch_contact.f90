!> Contact of nodes in space, and mortar, over stencils of meshes: gaps, identities, momenta,
!> derivatives, ends.
module test_patch_contact
   use box_contacts, only : box_kind => kind, draw, evaluate, look, make_boxes, seen, sum_up
   use check, only : check_near, check_true, test_case_t
   use emcon_constraint, only : condition_t
   use emcon_contact, only : contact_t
   use emcon_errors, only : error_t
   use emcon_guards, only : guard_slack
   use emcon_interactions, only : contact_pair_t
   use emcon_kinds, only : wp
   use emcon_mesh, only : surface_t
   use emcon_patch_contact_space, only : patch_contact_init, patch_contact_t
   use emcon_scene, only : scene_t
   use emcon_text, only : to_text
   use random_draws, only : draw_random
   use space_scenes, only : add_box, skin, space_begin
   implicit none
   private
   public :: collect_patch_contact

   real(wp), parameter :: eps = epsilon(1.0_wp)
   !> Some 100 roundings of quantities of size 1, here by the length of a patch, 1/30.
   real(wp), parameter :: tol = 1.0e4_wp*eps
   !> What closing terms leave out as round-off: 16 epsilon of a field that falls over a twentieth
   !> of a facet, by the least that is covered, 1/50; of four triangles with multipliers of up to 3.
   real(wp), parameter :: left_out = 16.0_wp*eps*20.0_wp*50.0_wp*4.0_wp*3.0_wp

contains

   subroutine collect_patch_contact(tests)
      type(test_case_t), allocatable, intent(out) :: tests(:)

      tests = [ &
         test_case_t("boxes over each other, whole skins", test_flat), &
         test_case_t("a box that is thin: its other side is not seen", test_thin), &
         test_case_t("a guard of a thin box lets nothing through", test_thin_guard), &
         test_case_t("identity and momenta", test_identity), &
         test_case_t("derivatives against differences", test_derivatives), &
         test_case_t("a surface fades past its end", test_end), &
         test_case_t("a node in a hole sees the wall, not the rim behind it", test_hole), &
         test_case_t("a corner first: the frame of all its faces", test_corner)]
   end subroutine collect_patch_contact

   !> The contact of the nodes of the upper one of two boxes.
   subroutine make(name, gap, shift, depth, scene, contact, error)
      character(len=*), intent(in) :: name
      real(wp), intent(in) :: gap, shift(2), depth
      type(scene_t), intent(out) :: scene
      type(patch_contact_t), intent(out) :: contact
      type(error_t), allocatable, intent(out) :: error
      type(contact_pair_t) :: pair

      call make_boxes(name, gap, shift, depth, scene, pair)
      call patch_contact_init(contact, scene, pair, error)
      if (.not. allocated(error)) call contact%suit_steps(.false.)
   end subroutine make

   !> Every node of the lower side sees the top; no other node sees anything within reach.
   subroutine test_flat(error)
      type(error_t), allocatable, intent(out) :: error
      real(wp), parameter :: gap(3) = [0.0_wp, 0.02_wp, -0.01_wp]
      type(scene_t) :: scene
      type(patch_contact_t) :: contact
      integer :: i, j, k

      do j = 1, 2
         do k = 1, size(gap)
            call make(box_kind(j), gap(k), [0.0_wp, 0.0_wp], 0.7_wp, scene, contact, error)
            if (allocated(error)) return
            call look(contact, scene, 0.0_wp*scene%x)
            do i = 1, contact%n_constraint
               associate (state => contact%state(i), at => scene%x(:, contact%node(i)))
                  if (at(3) > gap(k) + 0.1_wp) then
                     call check_true(error, .not. state%is_over, "above")
                  else
                     call check_true(error, count(contact%state%is_over .and. &
                        contact%node == contact%node(i)) == 1, "one of its frames is over it")
                     if (state%is_over) call check_near(error, [state%gap0, state%gap1], &
                        [gap(k), gap(k)], tol, 1.0_wp, box_kind(j) // " " // to_text(i))
                  end if
               end associate
            end do
         end do
      end do
   end subroutine test_flat

   !> A plate of a tenth of a facet: the lower side, as near, faces away.
   subroutine test_thin(error)
      type(error_t), allocatable, intent(out) :: error
      type(scene_t) :: scene
      type(patch_contact_t) :: contact
      integer :: i

      call make("C3D8", 0.01_wp, [0.1_wp, 0.07_wp], 0.03_wp, scene, contact, error)
      if (allocated(error)) return
      call look(contact, scene, 0.0_wp*scene%x)
      do i = 1, contact%n_constraint
         associate (state => contact%state(i))
            if (state%is_over) call check_near(error, state%gap0, 0.01_wp, tol, 1.0_wp, to_text(i))
         end associate
      end do
      call check_true(error, count(contact%state%is_over) >= 9, "nodes are over it")
   end subroutine test_thin

   !> A guard lets nodes in by a part of the facets, or of twice the thickness of a box.
   subroutine test_thin_guard(error)
      type(error_t), allocatable, intent(out) :: error
      real(wp), parameter :: depth(2) = [0.7_wp, 0.03_wp]
      type(scene_t) :: scene
      type(patch_contact_t) :: contact
      integer :: i, k

      do k = 1, size(depth)
         call make("C3D8", 0.01_wp, [0.1_wp, 0.07_wp], depth(k), scene, contact, error)
         if (allocated(error)) return
         contact%slack = guard_slack
         call look(contact, scene, 0.0_wp*scene%x)
         call check_true(error, any(contact%state%is_over), "nodes are over it")
         do i = 1, contact%n_constraint
            associate (state => contact%state(i))
               if (state%is_over) call check_near(error, state%closed, -guard_slack &
                  *min(state%size, state%other_size, 2.0_wp*depth(k)), tol, 1.0_wp, to_text(i))
            end associate
         end do
      end do
   end subroutine test_thin_guard

   !> A bar that leans in the hole of a plate. Along the normal of its right side are the wall of
   !> the hole in front and, far behind, the upper side of the plate, which hangs together with the
   !> wall around the hole and faces the bar too: a mean of both is a height of neither.
   subroutine test_hole(error)
      type(error_t), allocatable, intent(out) :: error
      real(wp), parameter :: tip(2) = [1.6_wp, -0.25_wp], s = sin(20.0_wp*acos(-1.0_wp)/180.0_wp), &
         c = sqrt(1.0_wp - s*s)
      type(scene_t) :: scene
      type(patch_contact_t) :: contact
      type(surface_t) :: all_of_it
      type(contact_pair_t) :: pair
      integer :: i

      call space_begin(scene)
      call add_box(scene, "C3D8", [-0.3_wp, 1.35_wp, 0.0_wp], [0.3_wp, 0.3_wp, 2.0_wp], [1, 1, 1])
      do i = 1, 8
         scene%x(::2, i) = tip + [c*scene%x(1, i) + s*scene%x(3, i), &
            c*scene%x(3, i) - s*scene%x(1, i)]
      end do
      call add_box(scene, "C3D8", [0.0_wp, 0.0_wp, -1.0_wp], [3.0_wp, 3.0_wp, 1.0_wp], [3, 3, 1])
      associate (kept => pack([(i, i = 1, 10)], [(i /= 6, i = 1, 10)]), element => scene%element)
         element%kind = element%kind(kept)
         element%node = element%node(:, kept)
         element%label = element%label(kept)
      end associate
      all_of_it = skin(scene)
      scene%surface = [all_of_it, all_of_it]
      associate (bar => all_of_it%element == 1)
         scene%surface(1)%element = pack(all_of_it%element, bar)
         scene%surface(1)%face = pack(all_of_it%face, bar)
         scene%surface(2)%element = pack(all_of_it%element, .not. bar)
         scene%surface(2)%face = pack(all_of_it%face, .not. bar)
      end associate
      scene%u0 = 0.0_wp*scene%x
      pair%slave = 1
      pair%master = 2
      call patch_contact_init(contact, scene, pair, error)
      if (allocated(error)) return
      call contact%suit_steps(.false.)
      contact%reach = 1.0_wp
      call contact%begin_step(scene%x, scene%u0, scene%u0)
      call contact%measure(scene%x, scene%u0, scene%u0)
      ! Their other frames see the walls at the bar's sides.
      associate (seen => count(contact%state%is_over .and. &
            abs(contact%state%gap0 - (2.0_wp - tip(1))/c) <= tol))
         call check_true(error, seen == 2, "both lower corners see the wall: " // to_text(seen))
      end associate
   end subroutine test_hole

   subroutine test_identity(error)
      type(error_t), allocatable, intent(out) :: error
      type(scene_t) :: scene
      class(contact_t), allocatable :: contact
      type(condition_t), allocatable :: item(:)
      real(wp), allocatable :: du(:, :)
      real(wp) :: work, sums(6), magnitude
      integer :: i, k

      do k = 1, 24
         call draw(k, 0.3_wp*0.09_wp**(k/4), scene, du, contact, error)
         if (allocated(error)) return
         call look(contact, scene, du)
         call evaluate(contact, scene, du, .true., seen(contact), item)
         call check_true(error, size(item) > 2, "nodes are over it")
         do i = 1, size(item)
            associate (nodes => item(i)%n_node)
               call sum_up(scene, du, item(i)%node(:nodes), item(i)%g(:, :nodes), work, sums, &
                  magnitude)
            end associate
            call check_near(error, work, item(i)%dgap, tol, magnitude*maxval(abs(du)), "identity")
            call check_near(error, item(i)%gap0 + item(i)%dgap, item(i)%gap1, left_out, 1.0_wp, &
               "ends")
            call check_near(error, sums, 0.0_wp*sums, tol, magnitude, "momenta")
         end do
      end do
   end subroutine test_identity

   !> Central differences err by the square of their way, times derivatives that grow with kinks by
   !> the length of a patch, beside round-off by the way.
   subroutine test_derivatives(error)
      type(error_t), allocatable, intent(out) :: error
      type(scene_t) :: scene
      class(contact_t), allocatable :: contact
      type(condition_t), allocatable :: item(:), up(:), down(:)
      real(wp), allocatable :: du(:, :), way(:, :)
      real(wp) :: step, bound
      integer :: i, k, n

      step = 0.1_wp*eps**(1.0_wp/3.0_wp)
      bound = 1.0e6_wp*step**2
      do k = 1, 8
         call draw(k, 0.1_wp, scene, du, contact, error)
         if (allocated(error)) return
         call look(contact, scene, du)
         way = 0.0_wp*du
         call draw_random(way)
         way = 2.0_wp*way - 1.0_wp
         call evaluate(contact, scene, du, .false., seen(contact), item)
         call evaluate(contact, scene, du + step*way, .true., seen(contact), up)
         call evaluate(contact, scene, du - step*way, .true., seen(contact), down)
         do i = 1, size(item)
            n = item(i)%n_node
            if (n /= up(i)%n_node .or. n /= down(i)%n_node) cycle
            if (any(item(i)%node(:n) /= up(i)%node(:n))) cycle
            associate (by => reshape(way(:, item(i)%node(:n)), [3*n]))
               call check_near(error, dot_product(reshape(item(i)%c(:, :n), [3*n]), by), &
                  (up(i)%gap1 - down(i)%gap1)/(2.0_wp*step), bound, 1.0_wp, "gradient")
               call check_near(error, matmul(item(i)%h(:3*n, :3*n), by), reshape((up(i)%g(:, :n) &
                  - down(i)%g(:, :n))/(2.0_wp*step), [3*n]), bound, &
                  max(1.0_wp, maxval(abs(item(i)%h(:3*n, :3*n)))), "second derivative")
            end associate
         end do
      end do
   end subroutine test_derivatives

   !> The upper box slides off: what is past the end by more than the flange and the patch is let
   !> go, and gaps stay what they are up to there.
   subroutine test_end(error)
      type(error_t), allocatable, intent(out) :: error
      type(scene_t) :: scene
      type(patch_contact_t) :: contact
      real(wp) :: past
      integer :: i, k

      do k = 0, 20
         past = 0.02_wp*real(k - 10, wp)
         call make("C3D8", 0.02_wp, [past, 0.0_wp], 0.7_wp, scene, contact, error)
         if (allocated(error)) return
         call look(contact, scene, 0.0_wp*scene%x)
         do i = 1, contact%n_constraint
            associate (state => contact%state(i), at => scene%x(:, contact%node(i)))
               if (at(3) > 0.1_wp) cycle
               if (state%is_over) call check_near(error, state%gap0, 0.02_wp, tol, 1.0_wp, "gap")
               if (at(1) <= 1.0_wp + 16.0_wp*eps .and. at(1) >= -16.0_wp*eps) then
                  call check_true(error, any(contact%state%is_over .and. contact%node &
                     == contact%node(i) .and. contact%cover > 1.0_wp - tol), &
                     "all of the patch, by " // &
                     to_text(past, 3))
               end if
               if (at(1) > 1.15_wp .or. at(1) < -0.15_wp) then
                  call check_true(error, .not. state%is_over, "past it, by " // to_text(past, 3))
               end if
            end associate
         end do
      end do
   end subroutine test_end

   !> A box on one of its corners: of the three faces there none faces the floor alone.
   subroutine test_corner(error)
      type(error_t), allocatable, intent(out) :: error
      type(scene_t) :: scene
      type(patch_contact_t) :: contact
      real(wp) :: one(3), two(3), three(3)
      integer :: i

      call make("C3D8", 0.0_wp, [0.0_wp, 0.0_wp], 0.7_wp, scene, contact, error)
      if (allocated(error)) return
      ! The diagonal upright.
      three = [1.0_wp, 1.0_wp, 1.0_wp]/sqrt(3.0_wp)
      one = [1.0_wp, -1.0_wp, 0.0_wp]/sqrt(2.0_wp)
      two = [-1.0_wp, -1.0_wp, 2.0_wp]/sqrt(6.0_wp)
      two = two*sign(1.0_wp, three(1)*(one(2)*two(3) - one(3)*two(2)))
      do i = 1, 64
         associate (at => scene%x(:, i))
            scene%u0(:, i) = [0.45_wp, 0.55_wp, 0.01_wp] + [dot_product(one, at), &
               dot_product(two, at), dot_product(three, at)] - at
         end associate
      end do
      call look(contact, scene, 0.0_wp*scene%x)
      call check_true(error, count(contact%state%is_over .and. contact%node == 1) == 1, &
         "one frame of the corner")
      do i = 1, contact%n_constraint
         if (.not. contact%state(i)%is_over) cycle
         if (contact%node(i) == 1) then
            call check_near(error, contact%state(i)%gap0, 0.01_wp, tol, 1.0_wp, "its gap")
         else
            call check_true(error, contact%state(i)%gap0 > 0.1_wp, "those beside it are higher")
         end if
      end do
   end subroutine test_corner

end module test_patch_contact
