!> Givers of forces for the tests: the solid of the library, a chain of springs, two wells.
module given_hosts
   use, intrinsic :: ieee_arithmetic, only : ieee_quiet_nan, ieee_value
   use emcon_csr, only : csr_find, csr_from_elements
   use emcon_errors, only : error_t
   use emcon_evaluation, only : evaluation_t
   use emcon_host_force, only : force_response_t, host_failed, host_force_t, host_ok, &
      host_outside
   use emcon_kinds, only : dp, wp
   use emcon_motion, only : motion_of, motion_t
   use emcon_point_function, only : point_function_t, point_ok
   use emcon_scene, only : scene_t
   use emcon_solid_term, only : solid_term_init, solid_term_t
   use emcon_space, only : lists_begin, lists_t, space_t
   use emcon_term, only : response_begin, response_init, response_t, role_internal
   implicit none
   private
   public :: solid_host_t, chain_host_t, well_t, solid_host_init, chain_host_init

   !> The elements of a scene as those of a host code.
   type, extends(host_force_t) :: solid_host_t
      type(solid_term_t) :: solid
      type(response_t) :: response
      logical :: tells_magnitude = .true.
   contains
      procedure :: respond => solid_host_respond
   end type solid_host_t

   !> Springs along x from node to node, of the energy k e^2/2 + c e^4/4 in their elongation e.
   type, extends(host_force_t) :: chain_host_t
      integer, allocatable :: node(:)
      real(wp) :: k = 1.0_wp, c = 0.0_wp
      logical :: tells_magnitude = .false.
      real(wp) :: longest = huge(1.0_wp)         !! springs longer than this are outside
      integer :: ends_at = huge(1)               !! the call that fails
      integer :: status_then = host_failed
      logical :: gives_nan = .false.             !! instead of failing
      integer :: n_call = 0
   contains
      procedure :: respond => chain_respond
   end type chain_host_t

   !> k r^2/2, or -k/r, of the distance r from the origin.
   type, extends(point_function_t) :: well_t
      real(wp) :: k = 1.0_wp
      logical :: is_harmonic = .true.
   contains
      procedure :: evaluate
   end type well_t

contains

   subroutine solid_host_init(self, scene, error)
      type(solid_host_t), intent(out) :: self
      type(scene_t), intent(in) :: scene
      type(error_t), allocatable, intent(out) :: error
      type(lists_t) :: lists
      type(space_t) :: space
      integer, allocatable :: slot(:)
      integer :: n

      self%name = "SOLID"
      call solid_term_init(self%solid, scene, error)
      if (allocated(error)) return
      n = size(scene%x, 2)
      call lists_begin(lists, 2)
      call self%solid%lay_out(lists)
      call csr_from_elements(self%pattern, 2*n, lists%start, lists%freedom, slot, error)
      if (allocated(error)) return
      call self%solid%begin_step(scene, 1, space, self%pattern, slot)
      call response_init(self%response, 2, n, size(scene%element%kind))
   end subroutine solid_host_init

   subroutine solid_host_respond(self, u0, du, wants_tangent, response)
      class(solid_host_t), intent(inout) :: self
      real(wp), intent(in), contiguous :: u0(:, :), du(:, :)
      logical, intent(in) :: wants_tangent
      type(force_response_t), intent(inout) :: response
      type(motion_t) :: motion
      real(dp) :: side(0)

      motion = motion_of(evaluation_t(), 0.0_wp*u0, u0, du)
      call response_begin(self%response)
      if (wants_tangent) then
         call self%solid%respond(motion, self%response, response%tangent, side)
      else
         call self%solid%respond(motion, self%response)
      end if
      if (allocated(self%response%refusal)) response%status = host_outside
      if (response%status /= host_ok) return
      associate (total => self%response%part(role_internal))
         response%force = total%force
         if (self%tells_magnitude) response%magnitude = total%magnitude
      end associate
      response%energy = sum(self%response%energy)
   end subroutine solid_host_respond

   !> Springs between the nodes `node` of `n_node` in turn.
   subroutine chain_host_init(self, node, n_node, error)
      type(chain_host_t), intent(out) :: self
      integer, intent(in) :: node(:), n_node
      type(error_t), allocatable, intent(out) :: error
      integer, allocatable :: slot(:)
      integer :: i, n

      n = size(node) - 1
      self%name = "CHAIN"
      self%node = node
      call csr_from_elements(self%pattern, 2*n_node, [(2*i + 1, i = 0, n)], &
         [(2*node(i:i + 1) - 1, i = 1, n)], slot, error)
   end subroutine chain_host_init

   subroutine chain_respond(self, u0, du, wants_tangent, response)
      class(chain_host_t), intent(inout) :: self
      real(wp), intent(in), contiguous :: u0(:, :), du(:, :)
      logical, intent(in) :: wants_tangent
      type(force_response_t), intent(inout) :: response
      real(wp) :: e0, e1, f, slope
      integer :: i, a, b

      response%status = host_ok
      self%n_call = self%n_call + 1
      if (self%n_call >= self%ends_at) then
         if (self%gives_nan) response%force = ieee_value(1.0_wp, ieee_quiet_nan)
         if (.not. self%gives_nan) response%status = self%status_then
         self%reason = "out of springs"
         return
      end if
      do i = 1, size(self%node) - 1
         a = self%node(i)
         b = self%node(i + 1)
         e0 = u0(1, b) - u0(1, a)
         e1 = e0 + (du(1, b) - du(1, a))
         if (abs(e1) > self%longest) response%status = host_outside
         f = (0.5_wp*self%k + 0.25_wp*self%c*(e0**2 + e1**2))*(e0 + e1)
         slope = 0.5_wp*self%k + 0.25_wp*self%c*((e0**2 + e1**2) + (e0 + e1)*2.0_wp*e1)
         response%energy = response%energy + 0.5_wp*self%k*e1**2 + 0.25_wp*self%c*e1**4
         response%force(1, b) = response%force(1, b) + f
         response%force(1, a) = response%force(1, a) - f
         if (self%tells_magnitude) response%magnitude(1, [a, b]) = &
            response%magnitude(1, [a, b]) + abs(f)
         if (.not. wants_tangent) cycle
         call add(a, a, slope)
         call add(b, b, slope)
         call add(a, b, -slope)
         call add(b, a, -slope)
      end do

   contains

      subroutine add(i, j, value)
         integer, intent(in) :: i, j
         real(wp), intent(in) :: value
         integer :: k

         k = csr_find(self%pattern, 2*i - 1, 2*j - 1)
         response%tangent(k) = response%tangent(k) + real(value, dp)
      end subroutine add

   end subroutine chain_respond

   subroutine evaluate(self, z, wants_hessian, value, gradient, hessian, status)
      class(well_t), intent(in) :: self
      real(wp), intent(in), contiguous :: z(:, :)
      logical, intent(in) :: wants_hessian
      real(wp), intent(inout), contiguous :: value(:), gradient(:, :), hessian(:, :, :)
      integer, intent(out) :: status
      real(wp) :: r
      integer :: i, a

      status = point_ok
      do i = 1, size(z, 2)
         r = norm2(z(:, i))
         if (self%is_harmonic) then
            value(i) = 0.5_wp*self%k*r**2
            gradient(:, i) = self%k*z(:, i)
         else
            value(i) = -self%k/r
            gradient(:, i) = self%k/r**3*z(:, i)
         end if
         if (.not. wants_hessian) cycle
         hessian(:, :, i) = 0.0_wp
         if (.not. self%is_harmonic) hessian(:, :, i) = -3.0_wp*self%k/r**5 &
            *spread(z(:, i), 2, 2)*spread(z(:, i), 1, 2)
         do a = 1, size(z, 1)
            hessian(a, a, i) = hessian(a, a, i) + merge(self%k, self%k/r**3, self%is_harmonic)
         end do
      end do
   end subroutine evaluate

end module given_hosts
