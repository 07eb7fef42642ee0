!> Static contact of bodies in tied pieces with unlike meshes, over the joints of their surfaces.
module test_tied_contact
   use check, only : check_equal, check_near, check_true, test_case_t
   use cut_scenes, only : add_tie, merge_surfaces
   use emcon_couplings, only : tie_rows_t
   use emcon_errors, only : error_t
   use emcon_interactions, only : contact_pair_t, formulation_mortar, formulation_nts, &
      formulation_segment, multiplier_dual, multiplier_standard, normal_edge, normal_nodal
   use emcon_kinds, only : dp, wp
   use emcon_ledger, only : ledger_t
   use emcon_march, only : increment_t, march_begin_step, march_free, march_increment, march_init, &
      march_is_done, march_t
   use emcon_quantities, only : contact_field
   use emcon_scene, only : scene_t
   use emcon_stepper, only : stepper_t
   use emcon_steps, only : method_null_space, method_saddle_point
   use emcon_text, only : to_text
   use small_scenes, only : add_block, add_step, add_surface, block_node, block_t, bottom, left, &
      prescribe, right, scene_begin, top, young
   implicit none
   private
   public :: collect_tied_contact

   real(wp), parameter :: eps = max(epsilon(1.0_wp), real(epsilon(1.0_dp), wp))
   !> Solutions of some 70 unknowns, as in the patch test of the march.
   real(wp), parameter :: tol = 450.0_wp*eps

contains

   subroutine collect_tied_contact(tests)
      type(test_case_t), allocatable, intent(out) :: tests(:)

      tests = [ &
         test_case_t("patch over joints", test_patch), &
         test_case_t("impact and sliding over joints", test_impact)]
   end subroutine collect_tied_contact

   !> The rows of a tie of two vertical sides of the same length, with dual multipliers: the hat
   !> functions are linear between all nodes, where Simpson's rule is exact.
   pure subroutine put_rows(scene, slave, master, rows)
      type(scene_t), intent(in) :: scene
      integer, intent(in) :: slave(:), master(:) !! nodes, upwards
      type(tie_rows_t), intent(out) :: rows
      real(wp), parameter :: simpson(3) = [1.0_wp, 4.0_wp, 1.0_wp]/6.0_wp
      real(wp) :: y(size(slave)), z(size(master)), break(size(slave) + size(master)), at, width
      real(wp) :: weight(0:size(master))
      integer :: i, j, k, q, n, m

      n = size(slave)
      m = size(master)
      y = scene%x(2, slave)
      z = scene%x(2, master)
      break(:n) = y
      break(n + 1:) = z
      do i = 1, n + m
         do j = i + 1, n + m
            if (break(j) < break(i)) break([i, j]) = break([j, i])
         end do
      end do
      rows%slave = slave
      rows%neighbour = reshape([(merge(i - 1, 0, i > 1), merge(i + 1, 0, i < n), i = 1, n)], [2, n])
      rows%start = [((m + 1)*i, i = 0, n)]
      allocate(rows%node(0), rows%weight(0), rows%size(n))
      do k = 1, n
         weight = 0.0_wp
         do i = 1, n + m - 1
            width = break(i + 1) - break(i)
            if (.not. width > 0.0_wp) cycle
            do q = 1, 3
               at = break(i) + width*(0.5_wp*(q - 1))
               associate (psi => dual(y, k, at, break(i) + 0.5_wp*width))
                  weight(0) = weight(0) + width*simpson(q)*psi
                  do j = 1, m
                     weight(j) = weight(j) - width*simpson(q)*psi*hat(z, j, at)
                  end do
               end associate
            end do
         end do
         rows%size(k) = weight(0)
         rows%node = [rows%node, slave(k), master]
         rows%weight = [rows%weight, weight]
      end do
   end subroutine put_rows

   !> The hat function of number `k` on the ascending places `y`.
   pure real(wp) function hat(y, k, at)
      real(wp), intent(in) :: y(:), at
      integer, intent(in) :: k

      hat = merge(1.0_wp, 0.0_wp, abs(at - y(k)) <= 0.0_wp)
      if (k > 1) then
         if (at < y(k)) hat = max(0.0_wp, (at - y(k - 1))/(y(k) - y(k - 1)))
      end if
      if (k < size(y)) then
         if (at > y(k)) hat = max(0.0_wp, (y(k + 1) - at)/(y(k + 1) - y(k)))
      end if
   end function hat

   !> The dual function of number `k` in the edge that `inside` is in: 2 N_k - N_other.
   pure real(wp) function dual(y, k, at, inside)
      real(wp), intent(in) :: y(:), at, inside
      integer, intent(in) :: k
      integer :: e

      e = count(y(:size(y) - 1) < inside)
      dual = 0.0_wp
      if (k == e) dual = 2.0_wp*hat(y, e, at) - hat(y, e + 1, at)
      if (k == e + 1) dual = 2.0_wp*hat(y, e + 1, at) - hat(y, e, at)
   end function dual

   !> A block of 4 x 1 on another one, each in two pieces of unlike meshes.
   subroutine make_scene(i, scene)
      integer, intent(in) :: i                   !! variant, 0..15
      type(scene_t), intent(out) :: scene
      type(block_t) :: block(4)
      type(contact_pair_t) :: pair
      real(wp), parameter :: cut(2) = [-0.3_wp, 0.4_wp]
      integer :: k, j, body

      call scene_begin(scene)
      call add_block(scene, "CPE4", [3, 1], [-2.0_wp, -1.0_wp], [2.0_wp + cut(1), 1.0_wp], block(1))
      call add_block(scene, "CPE4", [2, 2], [cut(1), -1.0_wp], [2.0_wp - cut(1), 1.0_wp], block(2))
      call add_block(scene, "CPE3", [2, 3], [-2.0_wp, 0.0_wp], [2.0_wp + cut(2), 1.0_wp], block(3))
      call add_block(scene, "CPE4", [3, 2], [cut(2), 0.0_wp], [2.0_wp - cut(2), 1.0_wp], block(4))
      do body = 1, 2
         do k = 2*body - 1, 2*body
            call add_surface(scene, "FACE", block(k), [merge(top, bottom, body == 1)])
            call add_surface(scene, "CUT", block(k), [merge(right, left, mod(k, 2) == 1)])
         end do
      end do
      call merge_surfaces(scene, "LOWER", 1, 3)
      call merge_surfaces(scene, "UPPER", 5, 7)
      call add_tie(scene, merge(2, 4, btest(i, 0)), merge(4, 2, btest(i, 0)))
      call add_tie(scene, merge(6, 8, btest(i, 0)), merge(8, 6, btest(i, 0)))
      do body = 1, 2
         associate (one => side_nodes(block(2*body - 1), .true.), &
               other => side_nodes(block(2*body), .false.), tie => scene%tie(body))
            if (btest(i, 0)) call put_rows(scene, one, other, tie%rows)
            if (.not. btest(i, 0)) call put_rows(scene, other, one, tie%rows)
         end associate
      end do
      pair%slave = 10
      pair%master = 9
      pair%formulation = formulation_mortar
      scene%pair = [pair]
      call add_step(scene, .true., 1.0_wp, 1)
      associate (step => scene%step(1))
         step%contact%options%multiplier = merge(multiplier_dual, multiplier_standard, btest(i, 1))
         step%contact%options%normal = merge(normal_nodal, normal_edge, btest(i, 2))
         step%contact%method = merge(method_null_space, method_saddle_point, btest(i, 3))
         do j = 1, size(scene%x, 2)
            if (abs(scene%x(1, j)) > 1.75_wp) call prescribe(step, j, 1, 0.0_wp)
            if (abs(scene%x(2, j)) > 0.75_wp) call prescribe(step, j, 2, &
               displacement(scene%x(:, j)))
         end do
      end associate
   end subroutine make_scene

   !> Nodes of the right or left side of a block, upwards.
   pure function side_nodes(block, is_right) result(node)
      type(block_t), intent(in) :: block
      logical, intent(in) :: is_right
      integer :: node(block%n(2) + 1)
      integer :: j

      node = [(block_node(block, merge(block%n(1), 0, is_right), j), j = 0, block%n(2))]
   end function side_nodes

   !> Pressed by a twentieth.
   pure real(wp) function displacement(x)
      real(wp), intent(in) :: x(2)

      displacement = -0.05_wp*(x(2) + 1.0_wp)
   end function displacement

   !> Uniaxial strain throughout, the same pressure at all places, and one place at each joint.
   subroutine test_patch(error)
      type(error_t), allocatable, intent(out) :: error
      integer :: i

      do i = 0, 15
         call run_patch(i, error)
         if (allocated(error)) return
      end do
   end subroutine test_patch

   subroutine run_patch(i, error)
      integer, intent(in) :: i
      type(error_t), allocatable, intent(out) :: error
      type(stepper_t) :: stepper
      type(increment_t) :: increment
      real(wp) :: expected
      integer :: k, n

      call make_scene(i, stepper%scene)
      associate (scene => stepper%scene, march => stepper%march)
         call march_init(march, scene, error)
         if (.not. allocated(error)) call march_begin_step(march, scene, 1, error)
         if (.not. allocated(error)) call march_increment(march, scene, increment, error)
         if (allocated(error)) return
         associate (u => march%state%u, reaction => march%state%reaction)
            call check_near(error, u(2, :), [(displacement(scene%x(:, k)), k = 1, size(u, 2))], &
               tol, 1.0_wp, "displacements, variant " // to_text(i))
            call check_near(error, u(1, :), 0.0_wp*u(1, :), tol, 1.0_wp, &
               "displacements across, variant " // to_text(i))
            expected = -sum(reaction(2, :), scene%x(2, :) > 0.75_wp)/4.0_wp
         end associate
         n = march%system%contact(1)%contact%n_constraint
         call check_equal(error, n, 6, "one constraint at the joint")
         call check_true(error, expected > 0.05_wp*young, "pressed")
         call check_fields(stepper, real(expected, dp), ", variant " // to_text(i), error)
         call march_free(march)
      end associate
   end subroutine run_patch

   !> The same pressure and no gap at all places, at both nodes of the joint too.
   subroutine check_fields(stepper, pressure, what, error)
      type(stepper_t), intent(inout) :: stepper
      real(dp), intent(in) :: pressure
      character(len=*), intent(in) :: what
      type(error_t), allocatable, intent(inout) :: error
      real(dp), allocatable :: stress(:, :), gap(:, :)
      integer :: k, n

      allocate(stress, source=contact_field(stepper, "CSTR"))
      allocate(gap, source=contact_field(stepper, "CDIS"))
      n = 0
      do k = 1, size(gap, 2)
         if (.not. is_slave(stepper%scene, k)) cycle
         n = n + 1
         call check_near(error, real(stress(:, k), wp), real([pressure, 1.0_dp], wp), tol, young, &
            "pressure, active" // what)
         call check_near(error, real(gap(1, k), wp), 0.0_wp, tol, 1.0_wp, "gap" // what)
      end do
      call check_equal(error, n, 7, "slave nodes")
   end subroutine check_fields

   !> Is node `k` one of the bottom of the upper block?
   pure logical function is_slave(scene, k)
      type(scene_t), intent(in) :: scene
      integer, intent(in) :: k

      is_slave = abs(scene%x(2, k)) < 0.25_wp .and. &
         k >= minval(scene%element%node(1, scene%surface(10)%element))
   end function is_slave

   !> The upper block flies onto the lower one and slides along it, so far that nodes of either pass
   !> the joint of the other: energy and momenta stay, whatever the formulation.
   subroutine test_impact(error)
      type(error_t), allocatable, intent(out) :: error
      integer, parameter :: formulation(3) = [formulation_nts, formulation_segment, &
         formulation_mortar]
      type(scene_t) :: scene
      integer :: i, upper

      do i = 1, 12
         call make_scene(i, scene)
         scene%pair(1)%formulation = formulation(1 + mod(i, 3))
         deallocate(scene%step)
         allocate(scene%step(0))
         call add_step(scene, .false., 0.04_wp, 20)
         upper = minval(scene%surface(10)%element)
         upper = minval(scene%element%node(:3, upper))
         scene%x(2, upper:) = scene%x(2, upper:) + 0.02_wp
         scene%v0(1, upper:) = 1.5_wp
         scene%v0(2, upper:) = -1.0_wp
         scene%step(1)%contact%method = merge(method_null_space, method_saddle_point, i > 6)
         call run_impact(i, error)
         if (allocated(error)) return
      end do

   contains

      subroutine run_impact(i, error)
         integer, intent(in) :: i
         type(error_t), allocatable, intent(out) :: error
         type(march_t) :: march
         type(increment_t) :: increment
         type(ledger_t) :: start
         integer :: n_touched, place

         call march_init(march, scene, error)
         if (.not. allocated(error)) call march_begin_step(march, scene, 1, error)
         if (allocated(error)) return
         start = march%ledger
         n_touched = 0
         associate (system => march%system)
            place = system%first_constraint(1) + findloc(system%contact(1)%contact%duplicate > 0, &
               .true., 1)
         end associate
         do while (.not. march_is_done(march))
            call march_increment(march, scene, increment, error)
            if (allocated(error)) return
            if (march%state%contacts%is_active(place)) n_touched = n_touched + 1
            call check_near(error, march%ledger%total, start%total, 10.0_wp*tol, start%total, &
               "energy, variant " // to_text(i))
            call check_near(error, [march%ledger%momentum, march%ledger%angular], &
               [start%momentum, start%angular], 10.0_wp*tol, 10.0_wp, "momenta, variant " &
               // to_text(i))
            if (allocated(error)) return
         end do
         call check_true(error, n_touched > 2, "joint in contact: " // to_text(n_touched))
         call march_free(march)
      end subroutine run_impact

   end subroutine test_impact

end module test_tied_contact
