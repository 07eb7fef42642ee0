!> Loads and prescribed motion of one step, as functions of time and configuration.
module emcon_loads
   use emcon_amplitudes, only : amplitude_t
   use emcon_csr, only : csr_t
   use emcon_kinds, only : dp, wp
   use emcon_motion, only : motion_t
   use emcon_evaluation, only : instant_t
   use emcon_prescribed, only : amplitude_at
   use emcon_element_kind, only : max_face_nodes
   use emcon_element_registry, only : face_shape_create
   use emcon_element_space, only : n_space
   use emcon_moment_load_plane, only : add_moment, add_moment_stiffness
   use emcon_moment_load_space, only : push_frame, push_frame_stiffness
   use emcon_pressure_plane, only : add_pressure, add_pressure_stiffness
   use emcon_pressure_ring_plane, only : press_ring, press_ring_stiffness
   use emcon_pressure_space, only : press_face, press_face_stiffness
   use emcon_reduction, only : freedom_numbers, reduction_slot
   use emcon_scene, only : scene_t
   use emcon_shape, only : shape_t, shape_table_t, shape_tabulate
   use emcon_solid, only : solid_t
   use emcon_space, only : lists_append, lists_t, space_t
   use emcon_steps, only : load_centrifugal, load_gravity, load_moment, load_point, &
      load_pressure, load_t, step_square
   use emcon_term, only : response_t, role_external, term_t
   implicit none
   private
   public :: loads_t, loads_init

   !> Point loads, moments on rigid bodies, pressures, gravity and centrifugal forces of a step.
   type, extends(term_t) :: loads_t
      type(load_t), allocatable :: load(:)
      type(amplitude_t), allocatable, private :: amplitude(:)   !! of the scene
      integer, allocatable, private :: frame(:, :)  !! (n_dim + 1, bodies) of rigid bodies
      !> (n_load) of pressures and moments: their number among these, else 0
      integer, allocatable, private :: at(:)
      integer, allocatable, private :: face(:, :)   !! (n, these) nodes that they act on together
      integer, allocatable, private :: n_on(:)      !! (these) how many
      !> (n_dim*n, n_dim*n, these) places of the stiffness between them
      integer, allocatable, private :: slot(:, :, :)
      logical, private :: is_ramped = .false.    !! static: without amplitude, linear over the step
      logical, private :: is_axial = .false.     !! on solids of revolution
      logical, allocatable, private :: is_linear(:)      !! (n_element) small strains in all steps
      logical, allocatable, private :: follows(:)        !! (n_load) a pressure on what deforms
      real(wp), private :: duration = 1.0_wp     !! [T]
      integer, allocatable, private :: node(:, :)        !! (n_most, n_element)
      real(wp), allocatable, private :: volume_mass(:, :)   !! int rho N_i, like `node` [M]
      !> Where there are centrifugal forces, int rho N_i (1, x): like `node` [M, M L]
      real(wp), allocatable, private :: own_mass(:, :), first_moment(:, :, :)
      real(wp), allocatable, private :: thickness(:)     !! (n_element) [L]
      type(shape_table_t), private :: on_face(max_face_nodes)   !! of faces of so many nodes
      real(wp), allocatable, private :: force(:, :)      !! (n_dim, n_node) [M L/T^2]
   contains
      procedure :: lay_out
      procedure :: begin_step
      procedure :: renew
      procedure :: respond
      procedure :: is_symmetric
   end type loads_t

contains

   !> Nodes of a frame that a moment acts on: two in the plane, all four in space.
   pure integer function moment_nodes(n_dim)
      integer, intent(in) :: n_dim

      moment_nodes = n_dim + merge(1, 0, n_dim == n_space)
   end function moment_nodes

   !> Loads on the elements of `solid` and their nodes; there are none before the first step.
   subroutine loads_init(self, scene, solid)
      type(loads_t), intent(out) :: self
      type(scene_t), intent(in) :: scene
      type(solid_t), intent(in) :: solid
      integer :: b

      self%role = role_external
      self%amplitude = scene%amplitude
      self%node = solid%node
      self%volume_mass = solid%mass%of_volume
      self%thickness = solid%thickness
      self%is_axial = solid%is_of_rings
      self%is_linear = solid%trait%is_linear
      allocate(self%load(0))
      allocate(self%frame(size(scene%x, 1) + 1, size(scene%rigid)))
      do b = 1, size(scene%rigid)
         self%frame(:, b) = scene%rigid(b)%frame
      end do
      allocate(self%force, mold=scene%x)
      if (size(scene%x, 1) == n_space) call tabulate_faces(self, scene)
      do b = 1, size(scene%step)
         if (allocated(self%own_mass)) exit
         if (any(scene%step(b)%load%kind == load_centrifugal)) call take_moments(self, scene%x, &
            solid)
      end do
   end subroutine loads_init

   !> Mass and first moments of mass that belong to the nodes of each element.
   subroutine take_moments(self, x, solid)
      type(loads_t), intent(inout) :: self
      real(wp), intent(in) :: x(:, :)            !! (n_dim, n_node) [L]
      type(solid_t), intent(in) :: solid
      integer :: e

      allocate(self%own_mass, mold=solid%mass%of_volume)
      allocate(self%first_moment(size(x, 1), size(solid%node, 1), solid%n_element))
      do e = 1, solid%n_element
         associate (n => solid%trait%n_node(e))
            associate (mass => solid%mass%consistent(:n, :n, e), node => solid%node(:n, e))
               self%own_mass(:n, e) = sum(mass, 2)
               self%first_moment(:, :n, e) = matmul(x(:, node), mass)
            end associate
         end associate
      end do
   end subroutine take_moments

   !> Shape functions on the faces of the kinds of elements.
   subroutine tabulate_faces(self, scene)
      type(loads_t), intent(inout) :: self
      type(scene_t), intent(in) :: scene
      class(shape_t), allocatable :: shape
      integer :: k

      do k = 1, size(scene%element%kinds)
         associate (n => scene%element%kinds(k)%n_face_node)
            call face_shape_create(n, shape)
            if (allocated(shape)) call shape_tabulate(shape, .true., self%on_face(n))
         end associate
      end do
   end subroutine tabulate_faces

   !> The frames of rigid bodies: their nodes meet under a moment, and are of one body.
   pure subroutine lay_out(self, lists)
      class(loads_t), intent(in) :: self
      type(lists_t), intent(inout) :: lists
      integer :: freedom(lists%n_dim, size(self%frame, 1), size(self%frame, 2)), a

      do a = 1, lists%n_dim
         freedom(a, :, :) = lists%n_dim*(self%frame - 1) + a
      end do
      call lists_append(lists, spread(lists%n_dim*size(self%frame, 1), 1, size(self%frame, 2)), &
         reshape(freedom, [size(freedom)]))
   end subroutine lay_out

   !> The loads of step `i_step`, and the places of the pressure stiffness in the matrix.
   subroutine begin_step(self, scene, i_step, space, matrix, slot)
      class(loads_t), intent(inout) :: self
      type(scene_t), intent(in) :: scene
      integer, intent(in) :: i_step              !! from 1
      type(space_t), intent(in) :: space
      type(csr_t), intent(in) :: matrix
      integer, intent(in) :: slot(:)             !! not needed: they are found again
      integer, allocatable :: number(:), all(:)
      integer :: dof(scene%n_dim, maxval([moment_nodes(scene%n_dim), &
         scene%element%kinds%n_face_node])), i, j, k, a

      call self%renew(scene, i_step)
      associate (step => scene%step(i_step))
         self%is_ramped = step%scheme%loads_ramp
         self%follows = step_square(step) > 0.0_wp .and. self%load%kind == load_pressure
         do i = 1, size(self%load)
            if (self%follows(i)) self%follows(i) = .not. self%is_linear(self%load(i)%target)
         end do
         self%duration = step%time%duration
      end associate
      call find_nodes(self, scene)
      allocate(number, source=freedom_numbers(space%numbering))
      do i = 1, size(self%n_on)
         associate (n => self%n_on(i))
            do a = 1, scene%n_dim
               dof(a, :n) = number(scene%n_dim*(self%face(:n, i) - 1) + a)
            end do
            all = reshape(dof(:, :n), [scene%n_dim*n])
         end associate
         do k = 1, size(all)
            do j = 1, size(all)
               self%slot(j, k, i) = reduction_slot(space%reduction, matrix, all(j), all(k))
            end do
         end do
      end do
   end subroutine begin_step

   !> The nodes that pressures and moments act on together.
   pure subroutine find_nodes(self, scene)
      class(loads_t), intent(inout) :: self
      type(scene_t), intent(in) :: scene
      logical :: is_on_some(size(self%load))
      integer :: e, i, k, n

      is_on_some = self%load%kind == load_pressure .or. self%load%kind == load_moment
      n = count(is_on_some)
      if (allocated(self%face)) deallocate(self%face, self%n_on, self%slot)
      associate (most => maxval([moment_nodes(scene%n_dim), scene%element%kinds%n_face_node]))
         allocate(self%face(most, n), self%n_on(n), source=0)
         allocate(self%slot(scene%n_dim*most, scene%n_dim*most, n), source=0)
      end associate
      self%at = unpack([(k, k = 1, n)], is_on_some, spread(0, 1, size(self%load)))
      do i = 1, size(self%load)
         if (.not. is_on_some(i)) cycle
         e = self%load(i)%target
         associate (n_on => self%n_on(self%at(i)), face => self%face(:, self%at(i)))
            if (self%load(i)%kind == load_moment) then
               n_on = moment_nodes(scene%n_dim)
               face(:n_on) = self%frame(:n_on, findloc(self%frame(1, :), e, 1))
            else
               associate (kind => scene%element%kinds(scene%element%kind(e)))
                  n_on = kind%n_face_node
                  face(:n_on) = scene%element%node(kind%face(self%load(i)%place), e)
               end associate
            end if
         end associate
      end do
   end subroutine find_nodes

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
            p = load_value(self, i, motion%evaluation%load_instant)
            select case (load%kind)
            case (load_point)
               self%force(load%place, load%target) = self%force(load%place, load%target) + p
            case (load_gravity)
               do j = 1, size(self%node, 1)
                  node = self%node(j, load%target)
                  if (node == 0) cycle
                  self%force(:, node) = self%force(:, node) &
                     + p*self%volume_mass(j, load%target)*load%direction(:size(self%force, 1))
               end do
            case (load_centrifugal)
               call add_centrifugal(self, load, p)
            case (load_pressure)
               p = p*self%thickness(load%target)
               call respond_pressure(self, i, p, motion, value, side)
            case (load_moment)
               call respond_moment(self, i, p, motion, value, side)
            end select
         end associate
      end do
      associate (total => response%part(self%role))
         total%force = total%force + self%force
         if (response%with_sizes) total%magnitude = total%magnitude + abs(self%force)
      end associate
   end subroutine respond

   !> The forces of an element that turns about an axis: omega**2 int rho N_i times the distance
   !> from the axis.
   pure subroutine add_centrifugal(self, load, square)
      type(loads_t), intent(inout) :: self
      type(load_t), intent(in) :: load
      real(wp), intent(in) :: square             !! omega**2 [1/T^2]
      real(wp) :: arm(size(self%force, 1))
      integer :: j

      associate (n => size(arm))
         do j = 1, size(self%node, 1)
            if (self%node(j, load%target) == 0) cycle
            arm = self%first_moment(:, j, load%target) &
               - self%own_mass(j, load%target)*load%point(:n)
            arm = arm - dot_product(load%direction(:n), arm)*load%direction(:n)
            associate (force => self%force(:, self%node(j, load%target)))
               force = force + square*arm
            end associate
         end do
      end associate
   end subroutine add_centrifugal

   !> Pressure `i` on its face, p times the thickness.
   subroutine respond_pressure(self, i, p, motion, value, side)
      class(loads_t), intent(inout) :: self
      integer, intent(in) :: i                   !! load
      real(wp), intent(in) :: p                  !! [M/T^2], in space and on rings [M/(L T^2)]
      type(motion_t), intent(in) :: motion       !! placed
      real(dp), intent(inout), contiguous, optional :: value(:), side(:)   !! slots > 0, slots < 0
      real(wp) :: place(size(self%force, 1), self%n_on(self%at(i)))
      integer :: j, m

      m = size(self%force, 1)*self%n_on(self%at(i))
      associate (face => self%face(:self%n_on(self%at(i)), self%at(i)))
         if (size(self%force, 1) == n_space) then
            do j = 1, size(face)
               place(:, j) = motion%x(:, face(j)) - motion%x(:, face(1))
               if (self%follows(i)) place(:, j) = place(:, j) &
                  + (motion%at(:, face(j)) - motion%at(:, face(1)))
            end do
            associate (table => self%on_face(size(face)))
               call press_face(face, table, p, place, self%force)
               if (present(value) .and. self%follows(i)) call press_face_stiffness(table, &
                  p*motion%load_weight, place, self%slot(:m, :m, self%at(i)), value, side)
            end associate
         else if (self%is_axial) then
            call press_ring(face, p, motion%x, motion%at, self%follows(i), self%force)
            if (present(value) .and. self%follows(i)) call press_ring_stiffness(face, &
               p*motion%load_weight, motion%x, motion%at, self%slot(:m, :m, self%at(i)), value, &
               side)
         else
            call add_pressure(face, p, motion%x, motion%at, self%follows(i), self%force)
            if (present(value) .and. self%follows(i)) call add_pressure_stiffness( &
               p*motion%load_weight, self%slot(:m, :m, self%at(i)), value, side)
         end if
      end associate
   end subroutine respond_pressure

   !> Moment `i` on the frame of its body.
   subroutine respond_moment(self, i, p, motion, value, side)
      class(loads_t), intent(inout) :: self
      integer, intent(in) :: i                   !! load
      real(wp), intent(in) :: p                  !! [M L^2/T^2]
      type(motion_t), intent(in) :: motion       !! placed
      real(dp), intent(inout), contiguous, optional :: value(:), side(:)   !! slots > 0, slots < 0
      real(wp) :: place(size(self%force, 1), self%n_on(self%at(i))), moment(size(self%force, 1))
      integer :: m

      associate (frame => self%face(:self%n_on(self%at(i)), self%at(i)), n_dim => size(moment))
         place = motion%x(:, frame) + motion%at(:, frame)
         m = size(place)
         if (n_dim == n_space) then
            moment = 0.0_wp
            moment(self%load(i)%place - n_dim) = p
            call push_frame(frame, moment, place, self%force)
            if (present(value)) call push_frame_stiffness(place, moment*motion%load_weight, &
               self%slot(:m, :m, self%at(i)), value, side)
         else
            call add_moment(frame, p, motion%x, motion%at, self%force)
            if (present(value)) call add_moment_stiffness(place, p*motion%load_weight, &
               self%slot(:m, :m, self%at(i)), value, side)
         end if
      end associate
   end subroutine respond_moment

   !> It is, unless a pressure follows the surface, or there is a moment.
   pure logical function is_symmetric(self, motion)
      class(loads_t), intent(in) :: self
      type(motion_t), intent(in) :: motion       !! placed

      is_symmetric = .not. (any(self%follows) .or. any(self%load%kind == load_moment))
   end function is_symmetric

end module emcon_loads
