!> Friction with a slope of stick: a spring that is stretched by slip, up to a limit.
!>
!> Over a step the spring e goes from where it was along the slip s until it pulls as much as the
!> limit, and from there on it slides. The mean of its force over that way takes what the spring
!> stores and what sliding at the limit loses, which is never negative. Vectors of one slip or two.
!> Source: docs/theory.md, eqs. (20m) and (20n).
module emcon_elastic_slip
   use emcon_constraint, only : most_slips
   use emcon_kinds, only : wp
   implicit none
   private
   public :: elastic_slip_t, elastic_slip_over, elastic_slip_at_end, elastic_slip_open

   type :: elastic_slip_t
      real(wp) :: stretch(most_slips) = 0.0_wp   !! e, before a step and after it [L]
      real(wp) :: drag(most_slips) = 0.0_wp      !! against slip, by the stiffness [L]
      real(wp) :: loss = 0.0_wp                  !! of energy, by the stiffness, >= 0 [L^2]
      real(wp) :: by_slip(most_slips, most_slips) = 0.0_wp   !! d drag by d slip
      real(wp) :: by_limit(most_slips) = 0.0_wp              !! d drag by d limit
   end type elastic_slip_t

contains

   !> Over a step, with the force of its mean.
   pure subroutine elastic_slip_over(self, limit, slip)
      type(elastic_slip_t), intent(inout) :: self
      real(wp), intent(in) :: limit              !! of the stretch, >= 0 [L]
      real(wp), intent(in) :: slip(most_slips)   !! s [L]
      real(wp), dimension(most_slips) :: start, trial, way, by_part
      real(wp) :: by_start(most_slips, most_slips), turned(most_slips, most_slips), part, size
      logical :: lets_go

      call let_go(self, limit, start, lets_go)
      trial = start + slip
      size = norm2(trial)
      if (.not. size > limit) then
         self%stretch = trial
         self%drag = start + 0.5_wp*slip
         self%by_slip = 0.5_wp*identity()
         by_start = identity()
         self%by_limit = 0.0_wp
      else
         way = trial/size
         turned = (identity() - outer(way, way))/size
         self%stretch = limit*way
         ! What slides, p = (size - limit) way, does its work at the limit.
         part = 0.5_wp*(size - limit)*(limit - dot_product(start, way))
         self%loss = self%loss + (size - limit)*limit
         self%drag = 0.5_wp*(start + self%stretch) + (part/sum(slip**2))*slip
         by_part = 0.5_wp*((limit - dot_product(start, way))*way &
            - (size - limit)*matmul(start, turned))
         self%by_slip = 0.5_wp*limit*turned + (part/sum(slip**2))*(identity() &
            - 2.0_wp*outer(slip, slip)/sum(slip**2)) + outer(slip, by_part)/sum(slip**2)
         by_start = 0.5_wp*(identity() + limit*turned) + outer(slip, by_part &
            - 0.5_wp*(size - limit)*way)/sum(slip**2)
         self%by_limit = 0.5_wp*way + (0.5_wp/sum(slip**2))*(size - limit &
            - (limit - dot_product(start, way)))*slip
      end if
      if (lets_go .and. limit > 0.0_wp) self%by_limit = self%by_limit &
         + matmul(by_start, start/limit)
   end subroutine elastic_slip_over

   !> To the end of a step, with the force there.
   pure subroutine elastic_slip_at_end(self, limit, slip)
      type(elastic_slip_t), intent(inout) :: self
      real(wp), intent(in) :: limit              !! of the stretch, >= 0 [L]
      real(wp), intent(in) :: slip(most_slips)   !! s [L]
      real(wp), dimension(most_slips) :: start, trial, way
      real(wp) :: size
      logical :: lets_go

      call let_go(self, limit, start, lets_go)
      trial = start + slip
      size = norm2(trial)
      self%by_limit = 0.0_wp
      if (.not. size > limit) then
         self%stretch = trial
         self%by_slip = identity()
      else
         way = trial/size
         self%stretch = limit*way
         self%loss = self%loss + (size - limit)*limit
         self%by_slip = (limit/size)*(identity() - outer(way, way))
         self%by_limit = way
      end if
      if (lets_go .and. limit > 0.0_wp) self%by_limit = self%by_limit &
         + matmul(self%by_slip, start/limit)
      self%drag = self%stretch
   end subroutine elastic_slip_at_end

   !> It has lost its surface: nothing is stretched any more.
   pure subroutine elastic_slip_open(self)
      type(elastic_slip_t), intent(inout) :: self

      self%loss = self%loss + 0.5_wp*sum(self%stretch**2)
      self%stretch = 0.0_wp
   end subroutine elastic_slip_open

   !> A limit that has fallen lets go of what is stretched beyond it.
   pure subroutine let_go(self, limit, start, lets_go)
      type(elastic_slip_t), intent(inout) :: self
      real(wp), intent(in) :: limit
      real(wp), intent(out) :: start(most_slips)   !! what is left [L]
      logical, intent(out) :: lets_go

      start = self%stretch
      self%loss = 0.0_wp
      lets_go = norm2(start) > limit
      if (.not. lets_go) return
      start = (limit/norm2(start))*start
      self%loss = 0.5_wp*(sum(self%stretch**2) - sum(start**2))
   end subroutine let_go

   pure function identity()
      real(wp) :: identity(most_slips, most_slips)
      integer :: i

      identity = 0.0_wp
      do i = 1, most_slips
         identity(i, i) = 1.0_wp
      end do
   end function identity

   !> a b^T
   pure function outer(a, b)
      real(wp), intent(in) :: a(most_slips), b(most_slips)
      real(wp) :: outer(most_slips, most_slips)
      integer :: j

      do j = 1, most_slips
         outer(:, j) = a*b(j)
      end do
   end function outer

end module emcon_elastic_slip
