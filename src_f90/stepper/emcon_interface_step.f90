!> What a host code asks an interface for in each step: gaps, discrete gradients, second
!> derivatives, the active set. To eliminate the multipliers: emcon_interface_null_space.
!>
!> A step of the host, from displacements u0 by du, for which it solves
!>
!>     M (2/h^2 du - 2/h v0) + f_int - sum lam_k g_k = 0,   defect_k = 0, k in the active set:
!>
!> `interface_begin_step` with the expected du; then, until `interface_update_active` is done:
!> `interface_select` the set, and Newton's method on `interface_evaluate`. If f_int is a discrete
!> gradient of its energy, energy and momenta are kept. Which contacts acted before, multipliers
!> and displacements are the host's: it may repeat a step with another size.
!> Source: docs/theory.md, sections 4 and 5.
module emcon_interface_step
   use emcon_active_set, only : active_set_advance, active_set_begin, active_set_drop, &
      active_set_select, step_cycling, step_done, step_stands_off, step_too_far
   use emcon_constraints, only : constraint_place, constraints_evaluate, constraints_force, &
      constraints_rows, constraints_select
   use emcon_contact, only : gap_state_t
   use emcon_csr, only : csr_from_entries, csr_t
   use emcon_errors, only : error_t
   use emcon_interface, only : interface_t
   use emcon_interface_check, only : check_field, check_list, refuse
   use emcon_interface_stage, only : check_begun, check_mask, check_motion, &
      check_multipliers
   use emcon_kinds, only : dp, wp
   use emcon_motion, only : motion_place
   use emcon_pose, only : pose_at_end, pose_t
   use emcon_steps, only : initiation_persistent
   use emcon_text, only : to_text
   implicit none
   private
   public :: constraint_values_t
   public :: interface_begin_step, interface_gaps, interface_select, interface_choose, &
      interface_evaluate, interface_curvature, interface_second_times, interface_update_active, &
      interface_drop, interface_slave_nodes
   public :: step_done, step_cycling, step_too_far, step_stands_off

   !> The selected constraints over a step, f = mean gap - target. Linearised in the motion at the
   !> end: force lam_k g_k by the discrete gradients g, defect by the gradients c. In statics
   !> (`is_end`) the start is the end: gap0 = gap1, dgap = 0, g = c.
   type :: constraint_values_t
      integer :: n = 0
      integer, allocatable :: id(:)              !! (n) ascending, 1..n_constraint
      real(wp), allocatable :: target(:)         !! (n) mean gap to hold [L]
      real(wp), allocatable :: gap0(:)           !! (n) f at the start [L]
      real(wp), allocatable :: gap1(:)           !! (n) at the end
      real(wp), allocatable :: dgap(:)           !! (n) gap1 - gap0, to relative accuracy
      real(wp), allocatable :: defect(:)         !! (n) what is to be 0: dgap where the gap at the
                                                 !! start is held, else gap1
      real(wp), allocatable :: size(:)           !! (n) length of an edge: defects relate to it
      type(csr_t) :: g                           !! (n x 2 n_node) g . du = dgap
      type(csr_t) :: c                           !! (n x 2 n_node) same pattern
   end type constraint_values_t

contains

   !> Choose what each constraint is made of for a step from `u0` with the expected motion `du`;
   !> `active` are those of `was_active` that can still act.
   subroutine interface_begin_step(self, u0, du, was_active, active, error)
      type(interface_t), intent(inout) :: self
      real(wp), intent(in), contiguous :: u0(:, :), du(:, :)   !! (2, n_node) [L]
      logical, intent(in) :: was_active(:)       !! (n_constraint) at the end of the step before
      logical, intent(out) :: active(:)          !! (n_constraint)
      type(error_t), allocatable, intent(out) :: error
      character(len=*), parameter :: place = "interface_begin_step"
      integer :: i

      active = .false.
      call check_motion(self, place, u0, du, error)
      call check_mask(self, place, "was_active", was_active, error)
      call check_mask(self, place, "active", active, error)
      if (allocated(error)) return
      do i = 1, size(self%system%contact)
         self%system%contact(i)%contact%reach = 0.0_wp     ! nothing depends on the past
      end do
      call take_motion(self, u0, du)
      self%state%u = u0
      self%state%is_active = was_active
      call take_options(self)
      call constraints_select(self%active%set, [integer ::])
      call active_set_begin(self%active, self%system, self%motion, self%state)
      active = self%active%is_active
      self%has_stencils = .true.
   end subroutine interface_begin_step

   !> All possible constraints at u0 and u0 + du, by the stencils of the step.
   subroutine interface_gaps(self, u0, du, state, error)
      type(interface_t), intent(inout) :: self
      real(wp), intent(in), contiguous :: u0(:, :), du(:, :)   !! (2, n_node) [L]
      type(gap_state_t), intent(out) :: state(:) !! (n_constraint)
      type(error_t), allocatable, intent(out) :: error
      integer :: i

      call check_motion(self, "interface_gaps", u0, du, error)
      call check_begun(self, "interface_gaps", error)
      if (.not. allocated(error) .and. size(state) /= self%n_constraint) call refuse(error, &
         "interface_gaps", "state has " // to_text(size(state)) // " entries, not " // &
         to_text(self%n_constraint))
      if (allocated(error)) return
      call measure(self, u0, du)
      do i = 1, size(self%system%contact)
         associate (first => self%system%first_constraint)
            state(first(i) + 1:first(i + 1)) = self%system%contact(i)%contact%state
         end associate
      end do
   end subroutine interface_gaps

   !> Take over a motion.
   subroutine take_motion(self, u0, du)
      type(interface_t), intent(inout) :: self
      real(wp), intent(in), contiguous :: u0(:, :), du(:, :)

      self%motion%pose = pose_t()
      if (self%is_end) self%motion%pose = pose_at_end
      self%motion%u0 = u0
      self%motion%du = du
      call motion_place(self%motion)
   end subroutine take_motion

   !> Measure all gaps, which the contacts keep.
   subroutine measure(self, u0, du)
      type(interface_t), intent(inout) :: self
      real(wp), intent(in), contiguous :: u0(:, :), du(:, :)
      integer :: i

      do i = 1, size(self%system%contact)
         call self%system%contact(i)%contact%measure(self%scene%x, u0, du)
      end do
   end subroutine measure

   !> The slave node of each possible constraint.
   subroutine interface_slave_nodes(self, node, error)
      type(interface_t), intent(in) :: self
      integer, allocatable, intent(out) :: node(:)         !! (n_constraint)
      type(error_t), allocatable, intent(out) :: error
      integer :: i

      if (.not. self%is_prepared) then
         call refuse(error, "interface_slave_nodes", "called before interface_prepare")
         return
      end if
      allocate(node(self%n_constraint))
      do i = 1, size(self%system%contact)
         associate (first => self%system%first_constraint)
            node(first(i) + 1:first(i + 1)) = self%system%contact(i)%contact%node
         end associate
      end do
   end subroutine interface_slave_nodes

   !> Select the constraints `active`, with the gaps to hold that `self%initiation` asks for.
   subroutine interface_select(self, u0, du, active, error)
      type(interface_t), intent(inout) :: self
      real(wp), intent(in), contiguous :: u0(:, :), du(:, :)   !! (2, n_node) [L]
      logical, intent(in) :: active(:)           !! (n_constraint)
      type(error_t), allocatable, intent(out) :: error
      character(len=*), parameter :: place = "interface_select"
      integer :: i

      call check_motion(self, place, u0, du, error)
      call check_begun(self, place, error)
      call check_mask(self, place, "active", active, error)
      if (allocated(error)) return
      call measure(self, u0, du)
      call check_near(self, place, pack([(i, i = 1, size(active))], active), error)
      if (allocated(error)) return
      call take_options(self)
      self%active%is_active = active
      call take_motion(self, u0, du)
      call active_set_select(self%active, self%system, self%motion)
   end subroutine interface_select

   !> Select the constraints `id`, with gaps to hold of the host's own choice.
   subroutine interface_choose(self, u0, du, id, target, error)
      type(interface_t), intent(inout) :: self
      real(wp), intent(in), contiguous :: u0(:, :), du(:, :)   !! (2, n_node) [L]
      integer, intent(in) :: id(:)               !! (n) ascending, 1..n_constraint
      real(wp), intent(in) :: target(:)          !! (n) mean gaps [L]
      type(error_t), allocatable, intent(out) :: error
      character(len=*), parameter :: place = "interface_choose"
      integer :: k, last

      call check_motion(self, place, u0, du, error)
      call check_begun(self, place, error)
      call check_list(error, place, "target", target, size(id))
      if (allocated(error)) return
      last = 0
      do k = 1, size(id)
         if (id(k) <= last .or. id(k) > self%n_constraint) then
            call refuse(error, place, "id(" // to_text(k) // ") is " // to_text(id(k)) // &
               "; they are to ascend in 1.." // to_text(self%n_constraint))
            return
         end if
         last = id(k)
      end do
      call measure(self, u0, du)
      call check_near(self, place, id, error)
      if (allocated(error)) return
      call constraints_select(self%active%set, id)
      self%active%set%target = target
   end subroutine interface_choose

   !> Values and gradients of the selected constraints for the step u0 to u0 + du.
   subroutine interface_evaluate(self, u0, du, values, error)
      type(interface_t), intent(inout) :: self
      real(wp), intent(in), contiguous :: u0(:, :), du(:, :)   !! (2, n_node) [L]
      type(constraint_values_t), intent(inout) :: values
      type(error_t), allocatable, intent(out) :: error
      character(len=*), parameter :: place = "interface_evaluate"

      call check_motion(self, place, u0, du, error)
      call check_begun(self, place, error)
      if (.not. allocated(error)) call check_near(self, place, self%active%set%id, error)
      if (allocated(error)) return
      call take_motion(self, u0, du)
      associate (set => self%active%set)
         call constraints_evaluate(set, self%system, self%motion)
         call constraints_rows(set, self%system%space%numbering)
         values%n = set%n
         values%id = set%id
         values%target = set%target
         values%gap0 = set%item%gap0
         values%gap1 = set%item%gap1
         values%dgap = set%item%dgap
         values%size = set%item%size
         values%defect = set%defect
         values%g = set%force_rows
         values%c = set%gap_rows
      end associate
   end subroutine interface_evaluate

   !> sum of lam_k d g_k/d q1 as last evaluated: the tangent of the step gets minus this.
   subroutine interface_curvature(self, lam, matrix, error)
      type(interface_t), intent(in) :: self
      real(wp), intent(in) :: lam(:)             !! (n) of the selected constraints [M L/T^2]
      type(csr_t), intent(out) :: matrix         !! (2 n_node x 2 n_node)
      type(error_t), allocatable, intent(out) :: error
      integer, allocatable :: row(:), column(:), slot(:)
      integer :: k, i, j, n

      call check_multipliers(self, "interface_curvature", lam, error)
      if (allocated(error)) return
      associate (item => self%active%set%item)
         n = sum(4*item%n_node**2)
         allocate(row(n), column(n))
         n = 0
         do k = 1, size(item)
            do j = 1, 2*item(k)%n_node
               do i = 1, 2*item(k)%n_node
                  n = n + 1
                  row(n) = dof_of(item(k)%node, i)
                  column(n) = dof_of(item(k)%node, j)
               end do
            end do
         end do
         call csr_from_entries(matrix, 2*self%n_node, 2*self%n_node, row, column, slot)
         n = 0
         do k = 1, size(item)
            do j = 1, 2*item(k)%n_node
               do i = 1, 2*item(k)%n_node
                  n = n + 1
                  matrix%value(slot(n)) = matrix%value(slot(n)) &
                     + real(lam(k)*item(k)%h(i, j), dp)
               end do
            end do
         end do
      end associate
   end subroutine interface_curvature

   !> sum of lam_k (d g_k/d q1) direction, as last evaluated.
   subroutine interface_second_times(self, lam, direction, product, error)
      type(interface_t), intent(in) :: self
      real(wp), intent(in) :: lam(:)             !! (n) of the selected constraints
      real(wp), intent(in) :: direction(:, :)    !! (2, n_node)
      real(wp), intent(out) :: product(:, :)     !! (2, n_node)
      type(error_t), allocatable, intent(out) :: error
      character(len=*), parameter :: place = "interface_second_times"
      integer :: k, i, j, a, b

      product = 0.0_wp
      call check_multipliers(self, place, lam, error)
      call check_field(error, place, "direction", direction, self%n_node)
      call check_field(error, place, "product", product, self%n_node)
      if (allocated(error)) return
      do k = 1, self%active%set%n
         associate (item => self%active%set%item(k))
            do j = 1, item%n_node
               do b = 1, 2
                  do i = 1, item%n_node
                     do a = 1, 2
                        product(a, item%node(i)) = product(a, item%node(i)) + lam(k) &
                           *item%h(2*(i - 1) + a, 2*(j - 1) + b)*direction(b, item%node(j))
                     end do
                  end do
               end do
            end do
         end associate
      end do
   end subroutine interface_second_times

   !> The next active set from a solved step: take in what would penetrate, release what pulls.
   !>
   !> `is_done`: the set stands, or `status` says why the step cannot be ended: `step_too_far` and
   !> `step_stands_off` ask for a smaller one, `step_cycling` for another one. Signs of round-off
   !> are told from tension by `magnitude`; without it by the contact forces themselves.
   subroutine interface_update_active(self, u0, du, lam, active, is_done, status, error, magnitude)
      type(interface_t), intent(inout) :: self
      real(wp), intent(in), contiguous :: u0(:, :), du(:, :)   !! (2, n_node) [L]
      real(wp), intent(in) :: lam(:)             !! (n) of the selected constraints [M L/T^2]
      logical, intent(inout) :: active(:)        !! (n_constraint) the selected ones; the next ones
      logical, intent(out) :: is_done
      integer, intent(out) :: status             !! one of the `step_` codes
      type(error_t), allocatable, intent(out) :: error
      real(wp), intent(in), optional :: magnitude(:, :)   !! (2, n_node) sum of |contributions| to
                                                          !! the residual [M L/T^2]
      real(wp) :: force(2, self%n_node)
      character(len=*), parameter :: place = "interface_update_active"

      is_done = .false.
      status = step_done
      call check_motion(self, place, u0, du, error)
      call check_begun(self, place, error)
      call check_multipliers(self, place, lam, error)
      call check_mask(self, place, "active", active, error)
      if (present(magnitude)) call check_field(error, place, "magnitude", magnitude, self%n_node)
      if (allocated(error)) return
      if (any(active .neqv. self%active%is_active) .or. count(active) /= size(lam)) then
         call refuse(error, place, "active is not the set of the last interface_select")
         return
      end if
      self%active%set%lam = lam
      self%active%lam(self%active%set%id) = lam
      call take_motion(self, u0, du)
      self%state%u = u0
      self%system%response%magnitude = 0.0_wp
      if (present(magnitude)) then
         self%system%response%magnitude = magnitude
      else
         call constraints_force(self%active%set, 1, force, self%system%response%magnitude)
      end if
      call active_set_advance(self%active, self%system, self%motion, is_done, status)
      active = self%active%is_active
   end subroutine interface_update_active

   !> Leave constraints out for the rest of the step, as they follow from others.
   subroutine interface_drop(self, redundant, active, error)
      type(interface_t), intent(inout) :: self
      integer, intent(in) :: redundant(:)        !! places in the selected set
      logical, intent(out) :: active(:)          !! (n_constraint) what is left
      type(error_t), allocatable, intent(out) :: error

      active = .false.
      call check_begun(self, "interface_drop", error)
      call check_mask(self, "interface_drop", "active", active, error)
      if (allocated(error)) return
      if (any(redundant < 1 .or. redundant > self%active%set%n)) then
         call refuse(error, "interface_drop", "redundant has entries outside 1.." // &
            to_text(self%active%set%n))
         return
      end if
      call active_set_drop(self%active, redundant)
      active = self%active%is_active
   end subroutine interface_drop

   !> Take over what the host may set between steps.
   pure subroutine take_options(self)
      type(interface_t), intent(inout) :: self

      self%active%masses_resist = .not. self%is_end
      self%active%holds_gap = self%initiation == initiation_persistent .and. .not. self%is_end
      self%active%gap_tolerance = self%gap_tolerance
      self%active%may_cut = self%may_cut
   end subroutine take_options

   !> A constraint without a surface within reach, as last measured, cannot act.
   pure subroutine check_near(self, place, id, error)
      type(interface_t), intent(in) :: self
      character(len=*), intent(in) :: place
      integer, intent(in) :: id(:)
      type(error_t), allocatable, intent(out) :: error
      integer :: k, pair, i

      do k = 1, size(id)
         call constraint_place(self%system, id(k), pair, i)
         associate (contact => self%system%contact(pair)%contact)
            if (contact%state(i)%is_near) cycle
            call refuse(error, place, "constraint " // to_text(id(k) - 1 + self%first) // &
               " (slave node " // to_text(self%scene%node_label(contact%node(i))) // " of pair " &
               // to_text(pair - 1 + self%first) // ") has no surface within reach")
         end associate
         return
      end do
   end subroutine check_near

   pure integer function dof_of(node, i)
      integer, intent(in) :: node(:)
      integer, intent(in) :: i                   !! local coordinate, node by node

      dof_of = 2*(node((i + 1)/2) - 1) + 2 - mod(i, 2)
   end function dof_of

end module emcon_interface_step
