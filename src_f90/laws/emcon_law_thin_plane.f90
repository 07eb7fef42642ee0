!> Laws of thin sheets, in plane stress: the strain normal to the plane is such that no stress acts
!> there.
!>
!> The energy is W*(e1, e2) = W at x, the normal strain E33 with dW/dx = 0, a function of the
!> invariants of the strain in the plane alone: nothing is kept from step to step. Over a step
!> dW* = W,e . de + W,x dx with discrete gradients W,e and W,x, the latter of second order as it
!> vanishes at both ends. With the slope of x at the start, corrected along the step such that
!> slope.de = dx, energy is exact. Source: docs/theory.md, eq. (10b).
module emcon_law_thin_plane
   use emcon_dgrad3, only : dg_t, dg_variable, operator(*), operator(+)
   use emcon_kinds, only : wp
   use emcon_law, only : law_hold_one, law_points_t, law_t
   implicit none
   private
   public :: law_thin_t, thin_law

   !> Of any law whose `energy` is right whatever E33 is; a linear law has this in itself.
   type, extends(law_t) :: law_thin_t
      class(law_t), allocatable :: solid         !! of the same material in bulk
   contains
      procedure :: take
      procedure :: energy
      procedure :: hold
   end type law_thin_t

   integer, parameter :: n_plane = 2             !! invariants of the strain in the plane

   !> The normal strain at one end of a step.
   type :: normal_t
      real(wp) :: x = 0.0_wp                     !! E33
      real(wp) :: slope(n_plane) = 0.0_wp        !! its derivative by the invariants
   end type normal_t

contains

   !> The law of a thin sheet of the material of `solid`.
   subroutine thin_law(solid, thin)
      class(law_t), intent(in) :: solid
      class(law_t), allocatable, intent(out) :: thin
      type(law_thin_t), allocatable :: made

      allocate(made)
      allocate(made%solid, source=solid)
      made%density = solid%density
      made%shear = solid%shear
      made%has_volume = solid%has_volume
      call move_alloc(made, thin)
   end subroutine thin_law

   !> Constants are those of the material in bulk.
   pure subroutine take(self, constant, fault)
      class(law_thin_t), intent(inout) :: self
      real(wp), intent(in) :: constant(:)        !! as the row of that law says
      character(len=:), allocatable, intent(out) :: fault   !! empty: nothing

      call self%solid%take(constant, fault)
      self%shear = self%solid%shear
   end subroutine take

   !> W* with its gradients by the two invariants of the strain in the plane.
   pure function energy(self, e1, e2, e3) result(w)
      class(law_thin_t), intent(in) :: self
      type(dg_t), intent(in) :: e1, e2           !! variables 1 and 2
      type(dg_t), intent(in) :: e3               !! not looked at
      type(dg_t) :: w, bulk
      type(normal_t) :: start, last
      real(wp) :: change(n_plane)

      change = [e1%df, e2%df]
      call find_normal(self%solid, [e1%f0, e2%f0], start)
      last = start
      call find_normal(self%solid, [e1%f1, e2%f1], last)
      bulk = bulk_energy(self%solid, [e1%f0, e2%f0], change, start%x, last%x - start%x)
      call condense(bulk, start, last, [e1%f0, e2%f0], change, w)
   end function energy

   !> W of invariants of the plane that go from `p` by `by`, and a normal strain from `x` by `dx`.
   pure function bulk_energy(solid, p, by, x, dx) result(w)
      class(law_t), intent(in) :: solid
      real(wp), intent(in) :: p(n_plane), by(n_plane), x, dx
      type(dg_t) :: w                            !! the third variable is x
      type(dg_t) :: e1, e2, e33

      e1 = dg_variable(1, p(1), by(1))
      e2 = dg_variable(n_plane, p(n_plane), by(n_plane))
      e33 = dg_variable(3, x, dx)
      w = solid%energy(e1 + e33, e2 + e33*e1, e33*e2)
   end function bulk_energy

   !> The normal strain where W is least, by Newton's method for the stretch t, 1 + 2 x = t^2: W is
   !> convex in each stretch alone, and halving what is left helps where a step leads out of that.
   pure subroutine find_normal(solid, p, normal)
      class(law_t), intent(in) :: solid
      real(wp), intent(in) :: p(n_plane)         !! invariants of the strain in the plane
      type(normal_t), intent(inout) :: normal    !! x: a guess
      real(wp), parameter :: near = sqrt(epsilon(1.0_wp)), none(n_plane) = 0.0_wp
      integer, parameter :: most = 100           ! halvings: more than there are digits
      real(wp) :: square, below, above, force, rate, correction, trial
      type(dg_t) :: w
      integer :: i

      below = -0.5_wp
      above = huge(1.0_wp)
      do i = 1, most
         square = 1.0_wp + 2.0_wp*normal%x
         w = bulk_energy(solid, p, none, normal%x, 0.0_wp)
         force = w%g(3)                          ! by a step of no size: h is half a derivative
         rate = force + 2.0_wp*w%h(3, 3)*square
         if (force > 0.0_wp) above = normal%x
         if (force < 0.0_wp) below = normal%x
         correction = -force/rate                       ! of t, over t
         trial = normal%x + correction*square*(1.0_wp + 0.5_wp*correction)
         if (.not. (rate > 0.0_wp .and. correction > -1.0_wp .and. trial >= below &
            .and. trial <= above)) then          ! 4 + 9 x: three times the stretch
            trial = 0.5_wp*(below + min(above, 4.0_wp + 9.0_wp*normal%x))
         end if
         correction = trial - normal%x
         normal%x = trial
         if (.not. abs(correction) > near*abs(trial)) exit
      end do
      w = bulk_energy(solid, p, none, normal%x, 0.0_wp)
      normal%slope = -w%h(3, :n_plane)/w%h(3, 3)
   end subroutine find_normal

   !> W* of W, which is `bulk`.
   pure subroutine condense(bulk, start, last, p, change, w)
      type(dg_t), intent(in) :: bulk
      type(normal_t), intent(in) :: start, last
      real(wp), intent(in) :: p(n_plane), change(n_plane)  !! invariants at the start, their change
      type(dg_t), intent(out) :: w
      real(wp), dimension(n_plane) :: slope, part
      real(wp) :: square, rest
      integer :: j

      ! Way over its square, but 0 where the way is round-off: what it is multiplied by is smaller.
      square = dot_product(change, change) + epsilon(1.0_wp)*dot_product(p, p) + tiny(1.0_wp)
      part = change/square
      rest = (last%x - start%x) - dot_product(start%slope, change)
      slope = start%slope + rest*part
      w%f0 = bulk%f0
      w%f1 = bulk%f1
      w%g(:n_plane) = bulk%g(:n_plane) + bulk%g(3)*slope
      w%df = dot_product(w%g(:n_plane), change)
      w%c(:n_plane) = bulk%c(:n_plane) + bulk%c(3)*last%slope
      do j = 1, n_plane
         w%h(:n_plane, j) = bulk%h(:n_plane, j) + bulk%h(:n_plane, 3)*last%slope(j) &
            + (bulk%h(3, j) + bulk%h(3, 3)*last%slope(j))*slope &
            + bulk%g(3)*((last%slope(j) - start%slope(j)) - (rest + rest)*part(j))*part
         w%h(j, j) = w%h(j, j) + bulk%g(3)*rest/square
      end do
   end subroutine condense

   !> Stress of points that do not move; the sheet is thinner by `stretch_33`.
   pure subroutine hold(self, points)
      class(law_thin_t), intent(in) :: self
      type(law_points_t), intent(inout) :: points    !! `dstrain` is 0
      type(normal_t) :: normal
      integer :: l

      associate (e => points%strain)
         do l = 1, size(e, 1)
            call law_hold_one(self, l, points)
            points%stress_33(l) = 0.0_wp
            normal%x = 0.0_wp
            call find_normal(self%solid, [e(l, 1) + e(l, 2), &
               e(l, 1)*e(l, 2) - 0.25_wp*e(l, 3)*e(l, 3)], normal)
            points%stretch_33(l) = sqrt(1.0_wp + 2.0_wp*normal%x)
         end do
      end associate
   end subroutine hold

end module emcon_law_thin_plane
