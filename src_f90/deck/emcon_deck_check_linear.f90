!> Linear sections: small kinematics and bodies that spin do not go together.
module emcon_deck_check_linear
   use emcon_bodies, only : bodies_find
   use emcon_deck_check_surfaces, only : mark_nodes
   use emcon_deck_reader, only : reader_t
   use emcon_diagnostics, only : add_error
   use emcon_kinds, only : wp
   use emcon_materials, only : kinematics_linear
   use emcon_rotation, only : cross_product
   use emcon_scene, only : scene_t
   use emcon_steps, only : step_is_dynamic
   use emcon_text, only : to_text
   implicit none
   private
   public :: check_linear

   !> A rotation that small kinematics do not follow [rad].
   real(wp), parameter :: most_turned = 0.1_wp
   integer, parameter :: n_space = 3

contains

   !> A free body with linear elements must not spin over its dynamic steps. What is prescribed,
   !> tied or in equations may have velocities like those of a spin, and swing.
   subroutine check_linear(reader, scene)
      type(reader_t), intent(inout) :: reader
      type(scene_t), intent(in) :: scene
      logical, allocatable :: is_linear(:), is_held(:)
      integer, allocatable :: body(:), node(:)
      integer :: b, i, n_body, section
      real(wp) :: turned

      if (reader%doubt%nodes .or. reader%doubt%elements) return
      if (reader%doubt%names .or. reader%doubt%rigid) return
      if (any(scene%element%section == 0) .or. .not. allocated(scene%v0)) return
      if (any(scene%element%node(1, :) == 0)) return           ! an element had errors
      is_linear = scene%section(scene%element%section)%kinematics == kinematics_linear
      do b = 1, size(scene%rigid)
         is_linear(scene%rigid(b)%element) = .false.
      end do
      if (.not. any(is_linear)) return
      call bodies_find(scene%element%node, size(scene%x, 2), body, n_body)
      call mark_held(scene, is_held)
      do b = 1, n_body
         node = pack([(i, i = 1, size(body))], body == b)
         i = findloc(is_linear .and. body(scene%element%node(1, :)) == b, .true., 1)
         if (i == 0 .or. any(is_held(node))) cycle
         turned = spin(scene%x(:, node), scene%v0(:, node)) &
            *sum(scene%step%time%duration, step_is_dynamic(scene%step))
         if (turned <= most_turned) cycle
         section = scene%element%section(i)
         call add_error(reader%log, scene%section(section)%origin, "section " // &
            scene%section(section)%set // " is linear, but its initial velocities turn the body " &
            // "of element " // to_text(scene%element%label(i)) // " by " // to_text(turned, 3) // &
            " rad within the steps: small kinematics follow no more than " // &
            to_text(most_turned) // "; use KINEMATICS=NONLINEAR")
      end do
   end subroutine check_linear

   !> Nodes that something else than contact keeps from spinning, perhaps.
   pure subroutine mark_held(scene, is_held)
      type(scene_t), intent(in) :: scene
      logical, allocatable, intent(out) :: is_held(:)    !! (n_node)
      integer :: i

      allocate(is_held(size(scene%x, 2)), source=.false.)
      do i = 1, size(scene%step)
         is_held(scene%step(i)%prescribed%node) = .true.
      end do
      do i = 1, size(scene%equation)
         is_held(scene%equation(i)%node) = .true.
      end do
      call mark_nodes(scene, [scene%tie%slave, scene%tie%master], is_held)
   end subroutine mark_held

   !> Angular velocity of the rotation that comes closest to the velocities of nodes.
   pure real(wp) function spin(x, v)
      real(wp), intent(in) :: x(:, :)            !! (n_dim, n) [L]
      real(wp), intent(in) :: v(:, :)            !! (n_dim, n) [L/T]
      real(wp) :: centre(size(x, 1)), moment(size(x, 1), size(x, 1)), inertia
      integer :: a, i

      centre = sum(x, 2)/real(size(x, 2), wp)
      moment = 0.0_wp
      inertia = 0.0_wp
      do i = 1, size(x, 2)
         do a = 1, size(x, 1)
            moment(:, a) = moment(:, a) + v(:, i)*(x(a, i) - centre(a))
         end do
         inertia = inertia + sum((x(:, i) - centre)**2)
      end do
      moment = moment - transpose(moment)
      spin = sqrt(0.5_wp*sum(moment**2))/inertia
      if (size(x, 1) == n_space) spin = spin_in_space(x - spread(centre, 2, size(x, 2)), moment, &
         spin)
   end function spin

   !> The same by the inertia about each axis; of nodes on a line the `otherwise`.
   pure real(wp) function spin_in_space(x, moment, otherwise)
      real(wp), intent(in) :: x(:, :)            !! (3, n) from the centre [L]
      real(wp), intent(in) :: moment(:, :)       !! (3, 3) sum of v x^T - x v^T [L^2/T]
      real(wp), intent(in) :: otherwise          !! [1/T]
      real(wp), parameter :: flat = 1024.0_wp*epsilon(1.0_wp)
      real(wp) :: inertia(n_space, n_space), cofactor(n_space, n_space), det, all_around
      real(wp) :: about(n_space)
      integer :: a

      inertia = -matmul(x, transpose(x))
      all_around = sum(x**2)
      do a = 1, n_space
         inertia(a, a) = inertia(a, a) + all_around
      end do
      do a = 1, n_space
         associate (b => 1 + mod(a, n_space), c => 1 + mod(a + 1, n_space))
            cofactor(:, a) = cross_product(inertia(:, b), inertia(:, c))
            about(a) = moment(c, b)
         end associate
      end do
      det = dot_product(inertia(:, 1), cofactor(:, 1))
      spin_in_space = otherwise
      if (det > flat*all_around**3) spin_in_space = norm2(matmul(about, cofactor))/det
   end function spin_in_space

end module emcon_deck_check_linear
