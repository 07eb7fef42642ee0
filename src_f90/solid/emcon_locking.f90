!> Where elements resist a change of volume at more points than their shape can follow.
module emcon_locking
   use emcon_kinds, only : wp
   use emcon_law, only : law_response_plane, law_response_t, law_t
   use emcon_solid, only : solid_t
   implicit none
   private
   public :: poisson_ratio, locking_element, locking_limit, locking_advice

   !> Elements with nodes at their corners alone lock above this ratio of Poisson.
   real(wp), parameter :: locking_limit = 0.45_wp
   !> By the number of dimensions.
   character(len=*), parameter :: locking_advice(2:3) = [character(len=66) :: &
      "it is too stiff in bending and contact; take CPE4H, CPE6 or CPE8R", &
      "it is too stiff in bending; take C3D8H, C3D10 or C3D20R"]

contains

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

   !> The element with the largest ratio above the limit that may lock, 0: none.
   pure subroutine locking_element(solid, element, ratio)
      type(solid_t), intent(in) :: solid
      integer, intent(out) :: element            !! 0..n_element
      real(wp), intent(out) :: ratio             !! of Poisson, of its law
      real(wp) :: of_law(size(solid%law))
      integer :: e, k

      of_law = 0.0_wp
      do k = 1, size(solid%law)
         if (allocated(solid%law(k)%law)) of_law(k) = poisson_ratio(solid%law(k)%law)
      end do
      element = 0
      ratio = locking_limit
      do e = 1, solid%n_element
         if (.not. solid%may_lock(e) .or. solid%is_rigid(e)) cycle
         if (.not. of_law(solid%law_of(e)) > ratio) cycle
         element = e
         ratio = of_law(solid%law_of(e))
      end do
   end subroutine locking_element

end module emcon_locking
