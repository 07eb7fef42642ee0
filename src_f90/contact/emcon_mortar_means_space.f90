!> What mortar contact in space has in common, whatever its master is: gaps of vertices are means
!> over what is covered of the slave facets around them. Source: docs/theory.md, section 14.2.
module emcon_mortar_means_space
   use emcon_contact, only : contact_t, strained_only
   use emcon_kinds, only : wp
   implicit none
   private
   public :: mortar_means_t, mortar_means_init

   type, abstract, extends(contact_t) :: mortar_means_t
      real(wp), allocatable :: whole(:)               !! (n_constraint) reference area [L^2]
      real(wp), allocatable :: scale(:)               !! (n_constraint) covered at the start [L^2]
      real(wp), allocatable :: cover(:)               !! (n_constraint) covered at the end [L^2]
   contains
      procedure :: area_points => mortar_area
      procedure :: own_area => mortar_own_area
      procedure :: share => mortar_share
      procedure :: least_free => mortar_least_free
      procedure :: mean_gap => mortar_mean_gap
   end type mortar_means_t

contains

   !> Room for what a step knows of vertices that have the areas `whole`.
   pure subroutine mortar_means_init(self, whole)
      class(mortar_means_t), intent(inout) :: self
      real(wp), intent(in) :: whole(:)           !! (n_constraint) in the reference [L^2]

      associate (n => self%n_constraint)
         allocate(self%duplicate(n), source=0)
         allocate(self%cover(n), self%sagitta(n), source=0.0_wp)
      end associate
      self%whole = whole
      self%scale = whole
      self%thickness = sqrt(whole)
   end subroutine mortar_means_init

   !> The multipliers are forces by the scale of their constraints.
   pure subroutine mortar_area(self, x, u, area, length)
      class(mortar_means_t), intent(in) :: self
      real(wp), intent(in), contiguous :: x(:, :), u(:, :)   !! (3, n_node) [L]
      real(wp), intent(out) :: area(:)           !! (n_constraint) [L^2]
      real(wp), intent(out) :: length(:)         !! (n_constraint) by the thickness [L]

      area = self%scale
      length = self%cover/self%thickness
   end subroutine mortar_area

   pure subroutine mortar_own_area(self, x, area)
      class(mortar_means_t), intent(in) :: self
      real(wp), intent(in), contiguous :: x(:, :)    !! (3, n_node) [L]
      real(wp), intent(out) :: area(:)           !! (n_constraint) [L^2]

      area = self%whole
   end subroutine mortar_own_area

   !> As `contact_t` has it.
   pure real(wp) function mortar_least_free(self) result(least_free)
      class(mortar_means_t), intent(in) :: self

      least_free = strained_only
   end function mortar_least_free

   !> Integrals of gaps are functions of the positions alone; their means know what was covered.
   pure real(wp) function mortar_share(self, i) result(share)
      class(mortar_means_t), intent(in) :: self
      integer, intent(in) :: i                   !! 1..n_constraint

      share = self%scale(i)/self%whole(i)
   end function mortar_share

   pure real(wp) function mortar_mean_gap(self, i, gap) result(mean_gap)
      class(mortar_means_t), intent(in) :: self
      integer, intent(in) :: i                   !! 1..n_constraint
      real(wp), intent(in) :: gap                !! integral by what was covered at the start [L]

      mean_gap = 0.0_wp
      if (self%cover(i) > 0.0_wp) mean_gap = gap*self%scale(i)/self%cover(i)
   end function mortar_mean_gap

end module emcon_mortar_means_space
