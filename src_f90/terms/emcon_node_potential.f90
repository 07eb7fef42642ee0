!> A potential V of the position of single nodes: gravity of a centre, a spring to a place, a soft
!> wall. Its forces come from the function alone, as discrete gradients.
!>
!> Source: docs/theory.md, sections 2 and 11.
module emcon_node_potential
   use emcon_csr, only : csr_from_elements
   use emcon_errors, only : err_input, error_t, raise
   use emcon_host_force, only : force_response_t, host_failed, host_force_t, host_ok
   use emcon_kinds, only : dp, wp
   use emcon_point_function, only : point_function_t, point_gradient, point_response_t
   use emcon_text, only : to_text
   implicit none
   private
   public :: node_potential_t, node_potential_init

   type, extends(host_force_t) :: node_potential_t
      integer, allocatable :: node(:)                !! (n)
      class(point_function_t), allocatable :: potential  !! of x, y [L]: V [M L^2/T^2]
      real(wp), allocatable, private :: x(:, :)      !! (n_dim, n) reference positions [L]
      real(wp), allocatable, private :: z(:, :), dz(:, :)   !! (n_dim, n) [L]
      type(point_response_t), private :: response
   contains
      procedure :: place
      procedure :: respond
   end type node_potential_t

contains

   !> The potential `potential`, called `name` in messages, on each of the nodes `node` of a model.
   subroutine node_potential_init(self, name, node, n_dim, n_node, potential, error)
      type(node_potential_t), intent(out) :: self
      character(len=*), intent(in) :: name       !! stands in messages
      integer, intent(in) :: node(:)                 !! 1..n_node, each once
      integer, intent(in) :: n_dim, n_node       !! of the model
      class(point_function_t), intent(in) :: potential
      type(error_t), allocatable, intent(out) :: error
      integer, allocatable :: slot(:)
      integer :: i, a, n

      n = size(node)
      call check(name, node, n_dim, n_node, potential, error)
      if (allocated(error)) return
      self%name = name
      self%node = node
      allocate(self%potential, source=potential)
      allocate(self%x(n_dim, n), self%z(n_dim, n), self%dz(n_dim, n), source=0.0_wp)
      self%is_symmetric_at_end = .true.
      call csr_from_elements(self%pattern, n_dim*n_node, [(n_dim*i + 1, i = 0, n)], &
         [((n_dim*(node(i) - 1) + a, a = 1, n_dim), i = 1, n)], slot, error)
   end subroutine node_potential_init

   subroutine check(name, node, n_dim, n_node, potential, error)
      character(len=*), intent(in) :: name
      integer, intent(in) :: node(:), n_dim, n_node
      class(point_function_t), intent(in) :: potential
      type(error_t), allocatable, intent(out) :: error
      logical, allocatable :: is_in(:)
      integer :: i

      if (potential%n_variable /= n_dim) then
         call refuse("is a function of " // to_text(potential%n_variable) // &
            " variables, not of the " // to_text(n_dim) // " coordinates of a node")
         return
      end if
      if (allocated(potential%weight)) then
         if (size(potential%weight) /= n_dim .or. .not. all(potential%weight > 0.0_wp)) then
            call refuse("needs " // to_text(n_dim) // " weights above 0, or none")
            return
         end if
      end if
      if (size(node) == 0) call refuse("names no node")
      allocate(is_in(n_node), source=.false.)
      do i = 1, size(node)
         if (node(i) < 1 .or. node(i) > n_node) then
            call refuse("names node " // to_text(node(i)) // ", which is not in 1.." // &
               to_text(n_node))
         else if (is_in(node(i))) then
            call refuse("names node " // to_text(node(i)) // " twice")
         end if
         if (allocated(error)) return
         is_in(node(i)) = .true.
      end do

   contains

      subroutine refuse(text)
         character(len=*), intent(in) :: text

         call raise(error, err_input, "the potential " // name // " " // text)
      end subroutine refuse

   end subroutine check

   !> Take the reference positions of the nodes.
   subroutine place(self, x)
      class(node_potential_t), intent(inout) :: self
      real(wp), intent(in), contiguous :: x(:, :)   !! (n_dim, n_node) reference positions [L]

      self%x = x(:, self%node)
   end subroutine place

   !> As `host_force_t` has it.
   subroutine respond(self, u0, du, wants_tangent, response)
      class(node_potential_t), intent(inout) :: self
      real(wp), intent(in), contiguous :: u0(:, :), du(:, :)   !! (n_dim, n_node) [L]
      logical, intent(in) :: wants_tangent       !! else no tangent is computed
      type(force_response_t), intent(inout) :: response   !! sized, 0 on entry
      integer :: i, n

      n = size(self%node)
      do i = 1, n
         self%z(:, i) = self%x(:, i) + u0(:, self%node(i))
         self%dz(:, i) = du(:, self%node(i))
      end do
      call point_gradient(self%potential, self%z, self%dz, wants_tangent, self%response, &
         response%status)
      if (response%status == host_failed) self%reason = "its function failed"
      if (response%status /= host_ok) return
      response%energy = sum(self%response%energy(:n))
      do i = 1, n
         response%force(:, self%node(i)) = self%response%gradient(:, i)
         response%magnitude(:, self%node(i)) = abs(self%response%gradient(:, i))
      end do
      if (wants_tangent) call put_tangent(self, response%tangent)
   end subroutine respond

   !> The tangents into the rows of the nodes.
   subroutine put_tangent(self, tangent)
      class(node_potential_t), intent(in) :: self
      real(dp), intent(inout) :: tangent(:)
      integer :: i, a, k, n_dim

      n_dim = size(self%x, 1)
      do i = 1, size(self%node)
         do a = 1, n_dim
            k = self%pattern%row_start(n_dim*(self%node(i) - 1) + a)
            tangent(k + 1:k + n_dim) = real(self%response%tangent(a, :, i), dp)
         end do
      end do
   end subroutine put_tangent

end module emcon_node_potential
