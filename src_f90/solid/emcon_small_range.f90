!> How far linear sections have left the range of small kinematics: the largest rotations and
!> strains of their quadrature points.
!>
!> A rotation is the size of the skew part of grad u, the sine of its angle; a strain
!> that of the symmetric part; of corotated elements both are in their frames.
module emcon_small_range
   use emcon_corotated_plane, only : corotated_init, corotated_strip, corotated_t
   use emcon_element, only : element_geometry_t
   use emcon_kinds, only : wp
   use emcon_small_widen_plane, only : small_widen_plane => small_widen
   use emcon_small_widen_space, only : small_widen_space => small_widen
   use emcon_solid, only : solid_geometry, solid_t
   implicit none
   private
   public :: small_range_t, small_range_init, small_range_widen, small_limit

   !> Errors of small kinematics are of the order of the rotation and the strain.
   real(wp), parameter :: small_limit = 0.05_wp
   integer, parameter :: n_space = 3

   type :: small_range_t
      integer, allocatable :: section(:)         !! (n) linear sections
      real(wp), allocatable :: rotation(:)       !! (n) largest so far [rad]
      real(wp), allocatable :: strain(:)         !! (n) largest so far
      type(corotated_t), allocatable, private :: frame(:)    !! (n_element) of corotated ones
   end type small_range_t

contains

   !> The linear sections of `solid`, at rest so far.
   pure subroutine small_range_init(self, solid)
      type(small_range_t), intent(out) :: self
      type(solid_t), intent(in) :: solid
      type(element_geometry_t) :: geometry
      integer :: i, most

      most = maxval(solid%deck%section)
      self%section = pack([(i, i = 1, most)], [(any(solid%deck%section == i &
         .and. solid%trait%is_small), i = 1, most)])
      allocate(self%rotation(size(self%section)), self%strain(size(self%section)), source=0.0_wp)
      if (.not. any(solid%trait%is_corotated)) return
      allocate(self%frame(solid%n_element))
      do i = 1, solid%n_element
         if (.not. solid%trait%is_corotated(i)) cycle
         call solid_geometry(solid, i, geometry)
         call corotated_init(self%frame(i), geometry, &
            solid%x(:, solid%node(:geometry%n_node, i)))
      end do
   end subroutine small_range_init

   !> Look at the displacements `u`.
   pure subroutine small_range_widen(self, solid, u)
      type(small_range_t), intent(inout) :: self
      type(solid_t), intent(in) :: solid
      real(wp), intent(in), contiguous :: u(:, :)        !! (n_dim, n_node) [L]
      real(wp), dimension(size(u, 1), size(solid%node, 1)) :: own, left
      real(wp), dimension(size(self%section)) :: rotation, strain   ! squares
      real(wp) :: turn(size(u, 1), size(u, 1))
      type(element_geometry_t) :: geometry
      integer :: e, i, s

      rotation = 0.0_wp
      strain = 0.0_wp
      do e = 1, solid%n_element
         if (.not. solid%trait%is_small(e)) cycle
         s = findloc(self%section, solid%deck%section(e), 1)
         call solid_geometry(solid, e, geometry)
         associate (node => solid%node(:, e))
            do i = 1, geometry%n_node
               own(:, i) = u(:, node(i)) - u(:, node(1))
            end do
            if (solid%trait%is_corotated(e)) then
               left = own
               call corotated_strip(self%frame(e), left, own, turn)
            end if
            if (size(u, 1) == n_space) then
               call small_widen_space(geometry, own, rotation(s), strain(s))
            else
               call small_widen_plane(geometry, own, rotation(s), strain(s))
            end if
         end associate
      end do
      self%rotation = max(self%rotation, sqrt(rotation))
      self%strain = max(self%strain, sqrt(strain))
   end subroutine small_range_widen

end module emcon_small_range
