!> Contact surfaces without mass: which nodes give theirs away, and to which.
!>
!> Without mass at one side of each contact the motion in contact is that of the massive freedoms in
!> a potential, whose force is continuous in time. An element that stands on massless nodes puts its
!> mass on its other nodes: the consistent mass between these, scaled to the mass of the element, so
!> that the total is exact, and frequencies change by the square of the element size. Source:
!> docs/theory.md, section 6.
module emcon_massless
   use emcon_csr, only : csr_t
   use emcon_errors, only : error_t
   use emcon_kinds, only : wp
   use emcon_scene, only : scene_t
   use emcon_solid, only : solid_t
   use emcon_steps, only : initiation_massless
   use emcon_surface_edges, only : surface_edges
   implicit none
   private
   public :: massless_find, massless_shed

contains

   !> The slave nodes of all pairs, if dynamic steps ask for massless surfaces; less those that are
   !> prescribed in such a step, dependent in ties and equations, or given mass, and those of
   !> elements that would keep none.
   pure subroutine massless_find(scene, solid, given, is_massless)
      type(scene_t), intent(in) :: scene
      type(solid_t), intent(in) :: solid
      type(csr_t), intent(in) :: given           !! (n_node x n_node) [M]; without rows: none
      logical, intent(out) :: is_massless(:)     !! (n_node)
      integer, allocatable :: edge(:, :)
      integer :: i

      is_massless = .false.
      if (.not. any(scene%step%initiation == initiation_massless .and. &
         scene%step%scheme%masses_resist)) return
      do i = 1, size(scene%pair)
         associate (surface => scene%surface(scene%pair(i)%slave))
            call surface_edges(scene, surface, edge)
            is_massless([edge]) = .true.
            if (surface%is_nodal) is_massless(surface%node) = .true.
         end associate
      end do
      do i = 1, size(scene%step)
         if (.not. scene%step(i)%scheme%masses_resist) cycle
         is_massless(scene%step(i)%prescribed%node) = .false.
      end do
      do i = 1, size(scene%tie)
         is_massless(scene%tie(i)%rows%node) = .false.
      end do
      do i = 1, size(scene%equation)
         is_massless(scene%equation(i)%node) = .false.
      end do
      do i = 1, given%n_row
         if (given%row_start(i + 1) > given%row_start(i)) is_massless(i) = .false.
      end do
      call keep_one(solid, is_massless)
   end subroutine massless_find

   !> Leave the nodes of each element that would keep no mass theirs.
   pure subroutine keep_one(solid, is_massless)
      type(solid_t), intent(in) :: solid
      logical, intent(inout) :: is_massless(:)
      logical :: keeps(size(is_massless))
      integer :: e

      keeps = .false.
      do e = 1, solid%n_element
         associate (node => solid%node(:solid%geometry(e)%n_node, e))
            if (all(is_massless(node))) keeps(node) = .true.
         end associate
      end do
      is_massless = is_massless .and. .not. keeps
   end subroutine keep_one

   !> Move the mass of elements from their massless nodes to their others.
   pure subroutine massless_shed(solid, is_massless)
      type(solid_t), intent(inout) :: solid
      logical, intent(in) :: is_massless(:)      !! (n_node)
      integer :: e, i

      do e = 1, solid%n_element
         associate (n => solid%geometry(e)%n_node)
            call shed(is_massless(solid%node(:n, e)), solid%mass(:n, :n, e))
            do i = 1, n
               solid%volume_mass(i, e) = sum(solid%mass(:n, i, e))
            end do
         end associate
      end do
   end subroutine massless_shed

   !> The same in one element.
   pure subroutine shed(is_massless, mass)
      logical, intent(in) :: is_massless(:)
      real(wp), intent(inout) :: mass(:, :)      !! [M]
      real(wp) :: total
      integer :: i

      if (.not. any(is_massless)) return
      total = sum(mass)
      do i = 1, size(is_massless)
         if (.not. is_massless(i)) cycle
         mass(i, :) = 0.0_wp
         mass(:, i) = 0.0_wp
      end do
      mass = mass*(total/sum(mass))
   end subroutine shed

end module emcon_massless
