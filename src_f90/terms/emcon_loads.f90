!> Loads and prescribed motion of one step, as functions of time and configuration.
module emcon_loads
   use emcon_amplitudes, only : amplitude_t
   use emcon_csr, only : csr_t
   use emcon_kinds, only : dp, wp
   use emcon_motion, only : motion_t
   use emcon_pose, only : instant_t
   use emcon_prescribed, only : amplitude_at
   use emcon_reduction, only : freedom_numbers, reduction_slot
   use emcon_scene, only : scene_t
   use emcon_solid, only : solid_t
   use emcon_space, only : space_t
   use emcon_steps, only : load_gravity, load_point, load_pressure, load_t
   use emcon_term, only : response_t, role_external, term_t
   implicit none
   private
   public :: loads_t, loads_init

   !> Point loads, pressures and gravity of a step.
   type, extends(term_t) :: loads_t
      type(load_t), allocatable :: load(:)
      type(amplitude_t), allocatable, private :: amplitude(:)   !! of the scene
      integer, allocatable, private :: edge(:, :)   !! (2, n) nodes of a loaded edge, else 0
      integer, allocatable, private :: slot(:, :)   !! (16, n) entries of the pressure stiffness
      logical, private :: is_ramped = .false.    !! static: without amplitude, linear over the step
      logical, private :: nlgeom = .false.
      real(wp), private :: duration = 1.0_wp     !! [T]
      integer, allocatable, private :: node(:, :)        !! (n_most, n_element)
      real(wp), allocatable, private :: volume_mass(:, :)   !! int rho N_i, like `node` [M]
      real(wp), allocatable, private :: thickness(:)     !! (n_element) [L]
      real(wp), allocatable, private :: force(:, :)      !! (2, n_node) [M L/T^2]
   contains
      procedure :: begin_step
      procedure :: renew
      procedure :: respond
      procedure :: is_symmetric
   end type loads_t

contains

   !> Loads on the elements of `solid` and their nodes; there are none before the first step.
   pure subroutine loads_init(self, scene, solid)
      type(loads_t), intent(out) :: self
      type(scene_t), intent(in) :: scene
      type(solid_t), intent(in) :: solid

      self%role = role_external
      self%amplitude = scene%amplitude
      self%node = solid%node
      self%volume_mass = solid%volume_mass
      self%thickness = solid%thickness
      allocate(self%load(0))
      allocate(self%force, mold=scene%x)
   end subroutine loads_init

   !> The loads of step `i_step`, and the places of the pressure stiffness in the matrix.
   subroutine begin_step(self, scene, i_step, space, matrix, slot)
      class(loads_t), intent(inout) :: self
      type(scene_t), intent(in) :: scene
      integer, intent(in) :: i_step              !! from 1
      type(space_t), intent(in) :: space
      type(csr_t), intent(in) :: matrix
      integer, intent(in) :: slot(:)             !! empty: what meets here meets in elements
      integer, allocatable :: number(:)
      integer :: i, e, dofs(4), j, k

      call self%renew(scene, i_step)
      associate (step => scene%step(i_step))
         self%is_ramped = step%scheme%loads_ramp
         self%nlgeom = step%nlgeom
         self%duration = step%duration
      end associate
      if (allocated(self%edge)) deallocate(self%edge, self%slot)
      allocate(self%edge(2, size(self%load)), self%slot(16, size(self%load)), source=0)
      allocate(number, source=freedom_numbers(space%numbering))
      do i = 1, size(self%load)
         if (self%load(i)%kind /= load_pressure) cycle
         e = self%load(i)%target
         self%edge(:, i) = scene%element_node( &
            scene%kind(scene%element_kind(e))%face_node(:, self%load(i)%place), e)
         dofs = number([2*self%edge(1, i) - 1, 2*self%edge(1, i), 2*self%edge(2, i) - 1, &
            2*self%edge(2, i)])
         do k = 1, 4
            do j = 1, 4
               self%slot(j + 4*(k - 1), i) = reduction_slot(space%reduction, matrix, dofs(j), &
                  dofs(k))
            end do
         end do
      end do
   end subroutine begin_step

   !> Take the loads of step `i_step` as they are.
   subroutine renew(self, scene, i_step)
      class(loads_t), intent(inout) :: self
      type(scene_t), intent(in) :: scene
      integer, intent(in) :: i_step              !! from 1

      self%load = scene%step(i_step)%load
   end subroutine renew

   !> Present size of load `i`.
   pure real(wp) function load_value(self, i, instant)
      class(loads_t), intent(in) :: self
      integer, intent(in) :: i
      type(instant_t), intent(in) :: instant
      real(wp) :: factor, rate

      associate (load => self%load(i))
         if (load%amplitude > 0) then
            call amplitude_at(self%amplitude(load%amplitude), instant, factor, rate)
            load_value = load%value*factor
         else if (self%is_ramped) then
            load_value = load%value_start &
               + (load%value - load%value_start)*min(1.0_wp, instant%step_time/self%duration)
         else
            load_value = load%value
         end if
      end associate
   end function load_value

   !> The loads of a motion, which act on it where it is placed.
   subroutine respond(self, motion, response, value, side)
      class(loads_t), intent(inout) :: self
      type(motion_t), intent(in) :: motion                     !! placed
      type(response_t), intent(inout) :: response
      real(dp), intent(inout), contiguous, optional :: value(:), side(:)   !! slots > 0, slots < 0
      real(wp) :: p
      integer :: i, j, node

      if (size(self%load) == 0) return
      self%force = 0.0_wp
      do i = 1, size(self%load)
         associate (load => self%load(i))
            p = load_value(self, i, motion%pose%load_instant)
            select case (load%kind)
            case (load_point)
               self%force(load%place, load%target) = self%force(load%place, load%target) + p
            case (load_gravity)
               do j = 1, size(self%node, 1)
                  node = self%node(j, load%target)
                  if (node == 0) cycle
                  self%force(:, node) = self%force(:, node) &
                     + p*self%volume_mass(j, load%target)*load%direction(:2)
               end do
            case (load_pressure)
               p = p*self%thickness(load%target)
               call add_pressure(self%edge(:, i), p, motion%x, motion%at, self%nlgeom, self%force)
               if (present(value) .and. self%nlgeom) then
                  call add_pressure_stiffness(p*motion%load_weight, self%slot(:, i), value, side)
               end if
            end select
         end associate
      end do
      associate (total => response%part(self%role))
         total%force = total%force + self%force
         total%magnitude = total%magnitude + abs(self%force)
      end associate
   end subroutine respond

   !> It is, unless a pressure follows the surface.
   pure logical function is_symmetric(self, motion)
      class(loads_t), intent(in) :: self
      type(motion_t), intent(in) :: motion       !! placed

      is_symmetric = .not. (self%nlgeom .and. any(self%load%kind == load_pressure))
   end function is_symmetric

   !> Pressure on the edge a-b: half of -p n |b - a| on either node, n outwards.
   pure subroutine add_pressure(edge, p, x, u, nlgeom, force)
      integer, intent(in) :: edge(2)
      real(wp), intent(in) :: p                            !! [M/T^2]: pressure times thickness
      real(wp), intent(in) :: x(:, :), u(:, :)
      logical, intent(in) :: nlgeom
      real(wp), intent(inout) :: force(:, :)
      real(wp) :: a(2), half(2)

      a = x(:, edge(2)) - x(:, edge(1))
      if (nlgeom) a = a + (u(:, edge(2)) - u(:, edge(1)))
      half = 0.5_wp*p*[-a(2), a(1)]
      force(:, edge(1)) = force(:, edge(1)) + half
      force(:, edge(2)) = force(:, edge(2)) + half
   end subroutine add_pressure

   !> The force is linear in the edge: f1 = p (a2 - b2)/2, f2 = p (b1 - a1)/2 on both nodes.
   pure subroutine add_pressure_stiffness(p, slot, value, side)
      real(wp), intent(in) :: p
      integer, intent(in) :: slot(16)
      real(dp), intent(inout) :: value(:), side(:)
      real(wp), parameter :: turn(2, 2) = reshape([0.0_wp, 1.0_wp, -1.0_wp, 0.0_wp], [2, 2])
      integer :: i, j, a, b, k
      real(wp) :: df

      do j = 1, 2
         do b = 1, 2
            do i = 1, 2
               do a = 1, 2
                  k = slot(a + 2*(i - 1) + 4*(b - 1 + 2*(j - 1)))
                  df = 0.5_wp*p*turn(a, b)*merge(1.0_wp, -1.0_wp, j == 2)
                  if (k > 0) value(k) = value(k) - real(df, dp)
                  if (k < 0) side(-k) = side(-k) - real(df, dp)
               end do
            end do
         end do
      end do
   end subroutine add_pressure_stiffness

end module emcon_loads
