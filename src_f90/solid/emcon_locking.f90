!> Where elements resist a change of volume at more points than their shape can follow, and where
!> they have points too few to resist all motions.
module emcon_locking
   use emcon_kinds, only : wp
   use emcon_law, only : law_response_plane, law_response_t, law_t
   use emcon_solid, only : solid_t
   implicit none
   private
   public :: locking_ratio, locking_element, locking_advice, bending_advice, strainless_element

   !> Elements with nodes at their corners alone lock above this ratio of Poisson; with incompatible
   !> modes they do at large strains, above the other.
   real(wp), parameter :: locking_limit = 0.45_wp, modes_limit = 0.495_wp
   character(len=*), parameter :: &
      in_plane = "it is too stiff in bending and contact; take CPE4H, CPE6 or CPE8R", &
      in_space = "it is too stiff in bending; take C3D8H, C3D10 or C3D20R", &
      of_rings = "it is too stiff in bending; take CAX6 or CAX8R"
   character(len=*), parameter :: &
      bent_in_plane = "take CPE4I, CPE6 or CPE8R, or more elements across", &
      bent_thin = "take CPS4I, CPS6 or CPS8R, or more elements across", &
      bent_in_space = "take C3D8I, C3D10 or C3D20R, or more elements across", &
      bent_of_rings = "take CAX6 or CAX8R, or more elements across"

   !> Dimensions of space.
   integer, parameter :: n_space = 3

contains

   !> What to take in place of elements of `solid` that lock. In the plane those of rings respond
   !> one by one.
   pure function locking_advice(solid) result(text)
      type(solid_t), intent(in) :: solid
      character(len=len(in_plane)) :: text

      text = in_plane
      if (solid%is_single) text = of_rings
      if (solid%n_dim == n_space) text = in_space
   end function locking_advice

   !> What to take in place of elements of `solid` that are too stiff where they bend.
   pure function bending_advice(solid) result(text)
      type(solid_t), intent(in) :: solid
      character(len=len(bent_in_space)) :: text

      text = bent_in_plane
      if (all(solid%trait%is_thin)) text = bent_thin
      if (solid%is_single) text = bent_of_rings
      if (solid%n_dim == n_space) text = bent_in_space
   end function bending_advice

   !> The ratio of Poisson of element `e` if it locks, else 0.
   pure real(wp) function locking_ratio(solid, e) result(ratio)
      type(solid_t), intent(in) :: solid
      integer, intent(in) :: e                   !! 1..n_element
      real(wp) :: limit

      ratio = 0.0_wp
      if (.not. solid%trait%may_lock(e) .or. solid%trait%is_rigid(e)) return
      if (.not. allocated(solid%law(solid%law_of(e))%law)) return
      ratio = poisson_ratio(solid%law(solid%law_of(e))%law)
      limit = merge(modes_limit, locking_limit, solid%trait%has_modes(e))
      if (.not. ratio > limit) ratio = 0.0_wp
   end function locking_ratio

   !> Of a law at rest: lambda/(2 lambda + 2 mu).
   pure real(wp) function poisson_ratio(law) result(ratio)
      class(law_t), intent(in) :: law
      real(wp), parameter :: rest(3) = 0.0_wp
      type(law_response_t) :: response
      real(wp) :: modulus

      call law_response_plane(law, rest, rest, response)
      modulus = 2.0_wp*response%tangent(1, 1)    ! by the end of a step of no size: a half
      ratio = 0.0_wp
      if (modulus > law%shear) ratio = 0.5_wp*(modulus - 2.0_wp*law%shear)/(modulus - law%shear)
   end function poisson_ratio

   !> The element that locks with the largest ratio, 0: none does.
   pure subroutine locking_element(solid, element, ratio)
      type(solid_t), intent(in) :: solid
      integer, intent(out) :: element            !! 0..n_element
      real(wp), intent(out) :: ratio             !! of Poisson, of its law
      real(wp) :: found
      integer :: e

      element = 0
      ratio = 0.0_wp
      do e = 1, solid%n_element
         found = locking_ratio(solid, e)
         if (.not. found > ratio) cycle
         element = e
         ratio = found
      end do
   end subroutine locking_element

   !> An element with fewer strains at its points than motions that are not rigid, 0: none. Rigid
   !> ones are as many as components of a strain.
   pure integer function strainless_element(solid) result(e)
      type(solid_t), intent(in) :: solid
      integer :: a, n_component

      n_component = sum([(a, a = 1, solid%n_dim)])
      do e = solid%n_element, 1, -1
         if (solid%is_of_rings .or. solid%trait%is_rigid(e)) cycle
         if (n_component*(solid%trait%n_point(e) + 1) < solid%n_dim*solid%trait%n_node(e)) return
      end do
   end function strainless_element

end module emcon_locking
