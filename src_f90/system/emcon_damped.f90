!> Conditions that are damped in a step: contacts that act, and those whose surfaces are near.
!>
!> Their forces are functions of the motion, not unknowns: each pushes along the discrete gradient
!> of its gap against the rate at which that changes, and along that of its slip against slip.
!> Source: docs/theory.md, eqs. (14n) to (14q).
module emcon_damped
   use emcon_constraint, only : condition_force, condition_t
   use emcon_dashpot_law, only : dashpot_at, dashpot_mean, dashpot_mean_slope
   use emcon_interactions, only : contact_damping_t
   use emcon_kinds, only : wp
   use emcon_motion, only : motion_t
   use emcon_numbering, only : numbering_t
   use emcon_system, only : system_t
   implicit none
   private
   public :: damped_t, dashpot_t, damped_select, damped_evaluate, damped_rows, damped_add_forces, &
      damped_stiffness, damped_work

   !> One condition that is damped.
   type :: dashpot_t
      type(contact_damping_t) :: law
      real(wp) :: area = 0.0_wp                  !! A of its node [L^2]
      real(wp) :: gap = 0.0_wp                   !! mean gap as the step begins [L]
      logical :: is_closed = .false.             !! contact holds it: it slides by the whole mu
      ! over the last motion:
      real(wp) :: push = 0.0_wp                  !! along the gradient of the gap [M L/T^2]
      real(wp) :: slope = 0.0_wp                 !! -d push / d gap at the end, >= 0 [M/T^2]
      real(wp) :: drag_slope = 0.0_wp            !! d drag / d slip, >= 0 [M/T^2]
      real(wp) :: drag_bend = 0.0_wp             !! d drag / d gap at the end [M/T^2]
   end type dashpot_t

   type :: damped_t
      integer :: n = 0
      integer, allocatable :: id(:)              !! (n) numbers over all conditions
      type(dashpot_t), allocatable :: dashpot(:) !! (n)
      type(condition_t), allocatable :: item(:)  !! (n) values and derivatives; `hold` is the drag
      ! where there are any, else not allocated:
      integer, allocatable :: row_start(:)       !! (n + 1) unknowns that each stands on
      integer, allocatable :: column(:)          !! from 0
   end type damped_t

contains

   !> Take the conditions `id` with their dashpots.
   pure subroutine damped_select(self, id, dashpot)
      type(damped_t), intent(inout) :: self
      integer, intent(in) :: id(:)               !! (n) ascending, from 1, of contacts
      type(dashpot_t), intent(in) :: dashpot(:)  !! (n)

      self%n = size(id)
      self%id = id
      self%dashpot = dashpot
      if (allocated(self%item)) deallocate(self%item)
      if (allocated(self%row_start)) deallocate(self%row_start, self%column)
      allocate(self%item(self%n))
      self%item%rubs = dashpot%law%tangent > 0.0_wp
   end subroutine damped_select

   !> Values, derivatives and forces over a motion. Gaps are counted from where they begin, so that
   !> what comes to be covered in the step is no way of the gap.
   subroutine damped_evaluate(self, system, motion, leaves_second)
      type(damped_t), intent(inout) :: self
      type(system_t), intent(inout) :: system
      type(motion_t), intent(in) :: motion       !! placed
      logical, intent(in) :: leaves_second       !! no second derivatives
      integer :: k, first, last

      self%item%leaves_second = leaves_second
      last = 0
      do k = 1, size(system%contact)
         first = last + 1
         last = count(self%id <= system%first_constraint(k + 1))
         if (last >= first) call system%contact(k)%contact%linearise(self%id(first:last) &
            - system%first_constraint(k), motion, self%dashpot(first:last)%gap, &
            self%item(first:last))
      end do
      do k = 1, self%n
         call find_forces(self%dashpot(k), self%item(k), motion%pose%mass_scale)
      end do
   end subroutine damped_evaluate

   !> Push and drag of a condition, docs/theory.md, eqs. (14o) and (14p).
   pure subroutine find_forces(dashpot, item, frequency)
      type(dashpot_t), intent(inout) :: dashpot
      type(condition_t), intent(inout) :: item   !! evaluated
      real(wp), intent(in) :: frequency          !! 1/h [1/T]
      real(wp) :: by_mu, mean

      associate (law => dashpot%law, gap => dashpot%gap, way => item%dgap)
         by_mu = dashpot%area*frequency
         mean = dashpot_mean(law, gap, way)
         dashpot%push = -by_mu*mean*way
         dashpot%slope = by_mu*dashpot_at(law, gap + way)
         if (.not. item%rubs) return
         if (dashpot%is_closed) mean = law%coefficient
         dashpot%drag_slope = law%tangent*by_mu*mean
         dashpot%drag_bend = 0.0_wp
         if (.not. dashpot%is_closed) dashpot%drag_bend = law%tangent*by_mu &
            *dashpot_mean_slope(law, gap, way)*item%slip
         item%hold = dashpot%drag_slope*item%slip
      end associate
   end subroutine find_forces

   !> The unknowns that each condition stands on.
   subroutine damped_rows(self, numbering)
      type(damped_t), intent(inout) :: self
      type(numbering_t), intent(in) :: numbering
      integer :: k, n, pass

      if (self%n == 0) return
      if (.not. allocated(self%row_start)) allocate(self%row_start(self%n + 1), source=0)
      do pass = 1, 2
         n = 0
         do k = 1, self%n
            call add_row(self%item(k))
            self%row_start(k + 1) = n
         end do
         if (pass == 2) return
         if (allocated(self%column)) then
            if (size(self%column) /= n) deallocate(self%column)
         end if
         if (.not. allocated(self%column)) allocate(self%column(n))
      end do

   contains

      !> Count the unknowns of a condition, and enter them once there is room.
      subroutine add_row(item)
         type(condition_t), intent(in) :: item
         integer :: i, t

         associate (n_dim => size(item%g, 1))
            do i = 1, item%n_node
               do t = numbering%start(n_dim*(item%node(i) - 1) + 1) + 1, &
                  numbering%start(n_dim*item%node(i) + 1)
                  if (numbering%column(t) == 0) cycle
                  n = n + 1
                  if (pass == 2) self%column(n) = numbering%column(t) - 1
               end do
            end do
         end associate
      end subroutine add_row

   end subroutine damped_rows

   !> Add the forces on all nodes, and to `magnitude` their sizes.
   pure subroutine damped_add_forces(self, force, magnitude)
      type(damped_t), intent(in) :: self
      real(wp), intent(inout), contiguous :: force(:, :)                 !! (n_dim, n_node)
      real(wp), intent(inout), contiguous, optional :: magnitude(:, :)   !! (n_dim, n_node)
      real(wp) :: part(size(force, 1))
      integer :: k, i

      do k = 1, self%n
         associate (item => self%item(k))
            do i = 1, item%n_node
               part = condition_force(item, self%dashpot(k)%push, i)
               force(:, item%node(i)) = force(:, item%node(i)) + part
               if (present(magnitude)) magnitude(:, item%node(i)) = magnitude(:, item%node(i)) &
                  + abs(part)
            end do
         end associate
      end do
   end subroutine damped_add_forces

   !> What the forces of condition `k` fall by, by the end coordinates of its nodes, node by node.
   pure function damped_stiffness(self, k) result(stiffness)
      type(damped_t), intent(in) :: self
      integer, intent(in) :: k                   !! 1..n
      real(wp) :: stiffness(size(self%item(k)%g, 1)*self%item(k)%n_node, &
         size(self%item(k)%g, 1)*self%item(k)%n_node)
      real(wp), dimension(size(stiffness, 1)) :: g, c, t, t1
      integer :: j, m

      m = size(g)
      associate (item => self%item(k), dashpot => self%dashpot(k))
         g = reshape(item%g(:, :item%n_node), [m])
         c = reshape(item%c(:, :item%n_node), [m])
         do j = 1, m
            stiffness(:, j) = (dashpot%slope*c(j))*g - dashpot%push*item%h(:m, j)
         end do
         if (.not. item%rubs) return
         t = reshape(item%t(:, :item%n_node), [m])
         t1 = reshape(item%t1(:, :item%n_node), [m])
         do j = 1, m
            stiffness(:, j) = stiffness(:, j) + item%hold*item%ht(:m, j) &
               + (dashpot%drag_slope*t1(j) + dashpot%drag_bend*c(j))*t
         end do
      end associate
   end function damped_stiffness

   !> What condition `k` has taken over the last motion, >= 0 [M L^2/T^2].
   pure real(wp) function damped_work(self, k) result(work)
      type(damped_t), intent(in) :: self
      integer, intent(in) :: k                   !! 1..n

      work = -self%dashpot(k)%push*self%item(k)%dgap
      if (self%item(k)%rubs) work = work + self%item(k)%hold*self%item(k)%slip
   end function damped_work

end module emcon_damped
