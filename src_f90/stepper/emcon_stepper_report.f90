!> Constraints over a step that were evaluated: values, gradients, second derivatives.
module emcon_stepper_report
   use emcon_constraint_rows, only : constraints_rows
   use emcon_constraints, only : constraint_index, constraint_set_t, constraints_evaluate, &
      constraints_select
   use emcon_contact, only : gap_state_t
   use emcon_csr, only : csr_copy_filled, csr_t, csr_transpose
   use emcon_csr_product, only : csr_product
   use emcon_curvature, only : curvature_add_times, curvature_matrix
   use emcon_errors, only : error_t
   use emcon_kinds, only : wp
   use emcon_numbering, only : numbering_init, numbering_t
   use emcon_evaluation, only : evaluation_t
   use emcon_host_check, only : host_check_matrix
   use emcon_stepper, only : stepper_t
   use emcon_stepper_check, only : check_field, check_list, check_that
   use emcon_friction, only : friction_select
   use emcon_gaps, only : gaps_measure, gaps_search
   use emcon_stepper_query, only : query_forget, query_place, query_sync, query_t
   use emcon_steps, only : prescribed_t
   implicit none
   private
   public :: contact_report_t, query_constraints, query_curvature, query_curvature_times, &
      query_pattern, query_set_map
   public :: report_evaluate, report_check_list

   !> Constraints over a step, ascending by their numbers: f = mean gap - target. Linearised in the
   !> motion at the end: force lam_k times row k of the discrete gradients, defect by the gradients
   !> at the end. In statics the start is the end: gap0 = gap1, dgap = 0, one gradient. What sticks
   !> has rows of its slips behind those of all gaps: f = target - slip, the multiplier is friction.
   !> What slides has none: its friction is in the force of its gap's row.
   type :: contact_report_t
      integer :: n = 0                           !! rows
      integer, allocatable :: slip(:)            !! (n) 0: a row of a gap; else of which slip
      integer, allocatable :: id(:)              !! (n) 1..n_constraint, as in `state_t`
      integer, allocatable :: pair(:)            !! (n) 1..n_pair; 0: a row of a tie or an equation
      integer, allocatable :: node(:)            !! (n) slave node, 1..n_node; 0 likewise
      real(wp), allocatable :: target(:)         !! (n) mean gap to hold [L]
      real(wp), allocatable :: gap0(:)           !! (n) f at the start [L]
      real(wp), allocatable :: gap1(:)           !! (n) at the end
      real(wp), allocatable :: dgap(:)           !! (n) gap1 - gap0, to relative accuracy
      real(wp), allocatable :: defect(:)         !! (n) what is to be 0: dgap where the gap at the
                                                 !! start is held, else gap1
      real(wp), allocatable :: size(:)           !! (n) length of an edge: defects relate to it
      type(csr_t) :: discrete_gradient           !! (n x 2 n_node) times du it is dgap
      type(csr_t) :: end_gradient                !! (n x 2 n_node) at the end
   end type contact_report_t

contains

   !> Gradients and second derivatives are from here on by unknowns of the host's: the freedoms of
   !> the nodes are `map` times these, up to what does not change. Displacements and other fields
   !> stay those of the nodes.
   subroutine query_set_map(self, stepper, map, error)
      type(query_t), intent(inout) :: self
      type(stepper_t), intent(in) :: stepper
      type(csr_t), intent(in) :: map             !! (n_dim n_node x unknowns of the host)
      type(error_t), allocatable, intent(out) :: error

      call host_check_matrix(map, size(stepper%scene%x), map%n_col, "the map", &
         "the freedoms of the nodes", error)
      if (.not. allocated(error)) call check_that(allocated(map%value), "the map has no values", &
         error)
      if (.not. allocated(error)) self%map = map
   end subroutine query_set_map

   !> Rows by the freedoms of the nodes, as the host is to have them.
   subroutine apply_map(self, rows)
      type(query_t), intent(in) :: self
      type(csr_t), intent(inout) :: rows
      type(csr_t) :: mapped

      if (.not. allocated(self%map)) return
      call csr_product(rows, self%map, mapped)
      rows = mapped
   end subroutine apply_map

   !> Which freedoms contact may couple in the step that was begun: those of all contacts that have
   !> a surface near, with their slips, by the stencils of the last look; 1 where an entry of
   !> `query_curvature`, or of C^T G, may come. `query_update_active` may choose other stencils.
   subroutine query_pattern(self, stepper, u0, du, pattern, error)
      type(query_t), intent(inout) :: self
      type(stepper_t), intent(in) :: stepper
      real(wp), intent(in), contiguous :: u0(:, :), du(:, :)   !! (n_dim, n_node) [L]
      type(csr_t), intent(out) :: pattern        !! over freedoms of nodes, or by the map
      type(error_t), allocatable, intent(out) :: error
      type(constraint_set_t) :: set
      type(gap_state_t), allocatable :: gap(:)
      type(csr_t) :: own
      integer :: k

      call check_that(self%has_begun, "no step of contact was begun", error)
      call query_place(self, stepper, u0, du, error)
      if (allocated(error)) return
      associate (march => self%march)
         call gaps_measure(march%system, march%motion, gap)
         call constraints_select(set, pack([(k, k = 1, size(gap))], gap%is_near))
         call friction_select(march%active%friction, set)
         call constraints_evaluate(set, march%system, march%motion)
         call curvature_matrix(set, spread(0.0_wp, 1, set%n_row), size(march%motion%x), own)
      end associate
      own%value = 1.0_wp
      call by_map(self, own, pattern)
      pattern%value = 1.0_wp
   end subroutine query_pattern

   !> A matrix over the freedoms of the nodes, as the host is to have it.
   subroutine by_map(self, own, matrix)
      type(query_t), intent(in) :: self
      type(csr_t), intent(inout) :: own
      type(csr_t), intent(out) :: matrix
      type(csr_t) :: half, turned
      integer, allocatable :: from(:)

      if (.not. allocated(self%map)) then
         matrix = own
         return
      end if
      call csr_product(own, self%map, half)
      call csr_transpose(self%map, turned, from)
      call csr_product(turned, half, matrix)
   end subroutine by_map

   !> All contact constraints near from displacements `u0` to `u1`. With `keeps_gap` they are those
   !> that hold the mean gap of `u0`, as persistent contact does: integrated gaps have other
   !> gradients then, and all gaps are counted from there.
   subroutine query_constraints(self, stepper, u0, u1, keeps_gap, report, error)
      type(query_t), intent(inout) :: self
      type(stepper_t), intent(in) :: stepper
      real(wp), intent(in) :: u0(:, :), u1(:, :)     !! (2, n_node) [L]
      logical, intent(in) :: keeps_gap
      type(contact_report_t), intent(out) :: report
      type(error_t), allocatable, intent(out) :: error
      type(gap_state_t), allocatable :: gap(:)
      logical, allocatable :: is_wanted(:)
      integer :: i, k

      call query_sync(self, stepper, error)
      call check_field("u0", u0, stepper%scene, error)
      call check_field("u1", u1, stepper%scene, error)
      if (allocated(error)) return
      call query_forget(self)                    ! the stencils are others from here on
      self%march%motion%evaluation = evaluation_t()
      call query_place(self, stepper, u0, u1 - u0, error)
      associate (system => self%march%system, set => self%march%active%set)
         call gaps_search(system, self%march%motion, gap)
         is_wanted = gap%is_near .and. gap%is_over
         do k = 1, size(system%contact)
            associate (contact => system%contact(k)%contact, first => system%first_constraint(k))
               do i = 1, contact%n_constraint
                  if (contact%waits(i)) is_wanted(first + i) = is_wanted(first + i) .and. &
                     gap(first + i)%gap1 < gap(first + i)%closed
               end do
            end associate
         end do
         call constraints_select(set, pack([(k, k = 1, size(gap))], is_wanted))
         if (keeps_gap) set%target = gap(set%id)%gap0
      end associate
      call report_evaluate(self, report)
   end subroutine query_constraints

   !> Evaluate the selected constraints, and report with gradients over all degrees of freedom.
   subroutine report_evaluate(self, report)
      type(query_t), intent(inout) :: self
      type(contact_report_t), intent(out) :: report
      type(numbering_t) :: freedoms
      type(prescribed_t) :: none(0)
      logical :: is_alive(size(self%march%motion%x, 1), size(self%march%motion%x, 2))
      integer :: k, i, pair

      is_alive = .true.
      call numbering_init(freedoms, is_alive, none)
      associate (system => self%march%system, set => self%march%active%set)
         call constraints_evaluate(set, system, self%march%motion)
         call constraints_rows(set, freedoms)
         report%n = set%n_row
         report%id = set%id(set%condition)
         report%slip = set%slip
         allocate(report%pair(set%n_row), report%node(set%n_row), source=0)
         do k = 1, set%n_row
            call constraint_index(system, report%id(k), pair, i)
            if (pair == 0) cycle
            report%pair(k) = abs(system%contact(pair)%of_pair)
            report%node(k) = system%contact(pair)%contact%node(i)
         end do
         report%target = set%target(set%condition)
         report%gap0 = set%item(set%condition)%gap0
         report%gap1 = set%item(set%condition)%gap1
         report%dgap = set%item(set%condition)%dgap
         report%size = set%item(set%condition)%size
         report%defect = set%defect
         do k = set%n + 1, set%n_row
            associate (item => set%item(set%condition(k)), s => set%slip(k))
               report%target(k) = item%slip_target(s)
               report%gap0(k) = item%slip_target(s)
               report%gap1(k) = set%defect(k)
               report%dgap(k) = -item%slip(s)
            end associate
         end do
         call csr_copy_filled(set%force_rows, report%discrete_gradient)
         call csr_copy_filled(set%gap_rows, report%end_gradient)
      end associate
      call apply_map(self, report%discrete_gradient)
      call apply_map(self, report%end_gradient)
      self%has_set = .true.
      self%has_null_space = .false.
   end subroutine report_evaluate

   !> Sum over the rows of the last evaluation of `factor` times the derivative of the force of its
   !> unit by the end: the tangent of a step gets minus this. What slides turns with its slip.
   subroutine query_curvature(self, factor, matrix, error)
      type(query_t), intent(inout) :: self
      real(wp), intent(in) :: factor(:)          !! (n) multipliers [M L/T^2]
      type(csr_t), intent(out) :: matrix         !! over freedoms of nodes, or by the map
      type(error_t), allocatable, intent(out) :: error

      type(csr_t) :: own

      call report_check_list(self, "factor", factor, error)
      if (allocated(error)) return
      call curvature_matrix(self%march%active%set, factor, size(self%march%motion%x), own)
      call by_map(self, own, matrix)
   end subroutine query_curvature

   !> The same times `direction`.
   subroutine query_curvature_times(self, stepper, factor, direction, product, error)
      type(query_t), intent(inout) :: self
      type(stepper_t), intent(in) :: stepper
      real(wp), intent(in) :: factor(:)              !! (n)
      real(wp), intent(in) :: direction(:, :)        !! (2, n_node)
      real(wp), allocatable, intent(out) :: product(:, :)      !! (2, n_node)
      type(error_t), allocatable, intent(out) :: error

      call report_check_list(self, "factor", factor, error)
      call check_field("direction", direction, stepper%scene, error)
      if (allocated(error)) return
      allocate(product, mold=direction)
      product = 0.0_wp
      call curvature_add_times(self%march%active%set, factor, direction, product)
   end subroutine query_curvature_times

   !> There are evaluated constraints, and `list` has a number for each of them.
   subroutine report_check_list(self, name, list, error)
      type(query_t), intent(in) :: self
      character(len=*), intent(in) :: name
      real(wp), intent(in) :: list(:)
      type(error_t), allocatable, intent(inout) :: error

      call check_that(self%has_set, "no constraints were evaluated since they were selected, " // &
         "or the unknowns changed", error)
      call check_list(name, list, self%march%active%set%n_row, error)
   end subroutine report_check_list

end module emcon_stepper_report
