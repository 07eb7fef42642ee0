!> Contact constraints between two configurations, the null space of those that act, and the linear
!> links, asked for from outside. Like all queries these leave the model as it is.
module emcon_stepper_constraints
   use emcon_constraints, only : constraint_place, constraint_set_t, constraints_evaluate, &
      constraints_rows, constraints_select
   use emcon_csr, only : csr_t
   use emcon_csr_product, only : csr_product
   use emcon_errors, only : err_analysis, err_input, error_t, raise
   use emcon_kinds, only : wp
   use emcon_motion, only : motion_place, motion_t
   use emcon_null_space, only : null_space_matrices, null_space_multipliers, obstacle_none, &
      obstacle_redundant
   use emcon_numbering, only : numbering_init, numbering_matrix, numbering_t, pick_unknowns
   use emcon_pose, only : pose_t
   use emcon_stepper, only : stepper_t
   use emcon_stepper_free, only : stepper_check_open
   use emcon_stepper_query, only : query_check_field, query_sync, query_t
   use emcon_steps, only : prescribed_t
   use emcon_system, only : system_t
   use emcon_text, only : to_text
   implicit none
   private
   public :: contact_report_t, query_constraints, query_check_factors, query_curvature_times
   public :: query_null_space, query_multipliers, query_links

   !> Contact constraints near each other's surfaces, ascending by their numbers. The gaps of a
   !> constraint differ by its discrete gradient times u1 - u0.
   type :: contact_report_t
      integer :: n = 0
      integer, allocatable :: id(:)              !! (n) 1..n_constraint, as in `state_t`
      integer, allocatable :: pair(:)            !! (n) 1..n_pair
      integer, allocatable :: node(:)            !! (n) slave node, 1..n_node
      real(wp), allocatable :: gap0(:)           !! (n) at u0 [L], > 0 open
      real(wp), allocatable :: gap1(:)           !! (n) at u1
      real(wp), allocatable :: dgap(:)           !! (n) gap1 - gap0, to relative accuracy
      real(wp), allocatable :: size(:)           !! (n) length of an edge [L]
      type(csr_t) :: discrete_gradient           !! (n x 2 n_node)
      type(csr_t) :: end_gradient                !! (n x 2 n_node) at u1
   end type contact_report_t

contains

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
      type(numbering_t) :: freedoms
      type(motion_t) :: motion
      logical, allocatable :: is_near(:)

      call query_sync(self, stepper, error)
      if (.not. allocated(error)) call query_check_field(stepper, u0, "u0", error)
      if (.not. allocated(error)) call query_check_field(stepper, u1, "u1", error)
      if (allocated(error)) return
      self%is_evaluated = .false.                ! the stencils are others from here on
      motion = self%march%motion
      motion%pose = pose_t()
      motion%u0 = u0
      motion%du = u1 - u0
      call motion_place(motion)
      associate (system => self%march%system)
         allocate(is_near(system%n_constraint))
         call find_near(system, motion, is_near)
         call select_near(self%near, system, is_near, keeps_gap)
         call constraints_evaluate(self%near, system, motion)
         call number_all(size(u0, 2), freedoms)
         call constraints_rows(self%near, freedoms)
         call fill_report(report, self%near, system)
      end associate
   end subroutine query_constraints

   !> The contact constraints with a surface near that they are over.
   subroutine find_near(system, motion, is_near)
      type(system_t), intent(inout) :: system
      type(motion_t), intent(in) :: motion
      logical, intent(out) :: is_near(:)             !! (n_constraint)
      integer :: pair

      is_near = .false.
      do pair = 1, size(system%contact)
         associate (contact => system%contact(pair)%contact)
            contact%reach = 0.0_wp               ! not what was found for another motion
            call contact%begin_step(motion%x, motion%u0, motion%du)
            call contact%measure(motion%x, motion%u0, motion%du)
            is_near(system%first_constraint(pair) + 1:system%first_constraint(pair + 1)) = &
               contact%state%is_near .and. contact%state%is_over .and. &
               (pair <= system%n_pair .or. contact%state%gap1 < contact%state%closed)
         end associate
      end do
   end subroutine find_near

   !> Hand the constraints to the set, with the gaps that they are counted from.
   subroutine select_near(set, system, is_near, keeps_gap)
      type(constraint_set_t), intent(inout) :: set
      type(system_t), intent(in) :: system
      logical, intent(in) :: is_near(:)              !! (n_constraint)
      logical, intent(in) :: keeps_gap
      integer :: k, pair, i

      call constraints_select(set, pack([(k, k = 1, size(is_near))], is_near))
      if (.not. keeps_gap) return
      do k = 1, set%n
         call constraint_place(system, set%id(k), pair, i)
         set%target(k) = system%contact(pair)%contact%state(i)%gap0
      end do
   end subroutine select_near

   !> Every degree of freedom a column of its own: a of node i is 2 (i - 1) + a.
   subroutine number_all(n_node, freedoms)
      integer, intent(in) :: n_node
      type(numbering_t), intent(out) :: freedoms
      type(prescribed_t) :: none(0)
      logical, allocatable :: is_alive(:, :)

      allocate(is_alive(2, n_node), source=.true.)
      call numbering_init(freedoms, is_alive, none)
   end subroutine number_all

   subroutine fill_report(report, set, system)
      type(contact_report_t), intent(inout) :: report
      type(constraint_set_t), intent(in) :: set
      type(system_t), intent(in) :: system
      integer :: k, i, contact

      report%n = set%n
      report%id = set%id
      allocate(report%pair(set%n), report%node(set%n))
      allocate(report%gap0(set%n), report%gap1(set%n), report%dgap(set%n), report%size(set%n))
      do k = 1, set%n
         call constraint_place(system, set%id(k), contact, i)
         report%pair(k) = abs(system%contact(contact)%of_pair)
         report%node(k) = system%contact(contact)%contact%node(i)
         report%gap0(k) = set%item(k)%gap0
         report%gap1(k) = set%item(k)%gap1
         report%dgap(k) = set%item(k)%dgap
         report%size(k) = set%item(k)%size
      end do
      call take_filled(set%force_rows, report%discrete_gradient)
      call take_filled(set%gap_rows, report%end_gradient)
   end subroutine fill_report

   !> The rows without the room that is left after the last one.
   pure subroutine take_filled(rows, matrix)
      type(csr_t), intent(in) :: rows
      type(csr_t), intent(out) :: matrix
      integer :: n

      n = rows%row_start(rows%n_row + 1)
      matrix%n_row = rows%n_row
      matrix%n_col = rows%n_col
      allocate(matrix%row_start, source=rows%row_start)
      allocate(matrix%column, source=rows%column(:n))
      allocate(matrix%value, source=rows%value(:n))
   end subroutine take_filled

   !> There is a report, of `n` constraints.
   subroutine query_check_factors(self, n, error)
      type(query_t), intent(in) :: self
      integer, intent(in) :: n
      type(error_t), allocatable, intent(out) :: error

      if (.not. allocated(self%near%item)) then
         call raise(error, err_input, "no constraints were asked for yet")
      else if (n /= self%near%n) then
         call raise(error, err_input, to_text(self%near%n) // " factors are needed, not " // &
            to_text(n))
      end if
   end subroutine query_check_factors

   !> Sum over the constraints of the last report of `factor` times the derivative of the discrete
   !> gradient by u1 times `direction`.
   subroutine query_curvature_times(self, factor, direction, product, error)
      type(query_t), intent(in) :: self
      real(wp), intent(in) :: factor(:)              !! (n of the report)
      real(wp), intent(in) :: direction(:, :)        !! (2, n_node)
      real(wp), intent(out) :: product(:, :)         !! (2, n_node)
      type(error_t), allocatable, intent(out) :: error
      integer :: k, i, j

      product = 0.0_wp
      call query_check_factors(self, size(factor), error)
      if (allocated(error)) return
      if (any(shape(direction) /= shape(self%contact)) &
         .or. any(shape(product) /= shape(self%contact))) then
         call raise(error, err_input, "direction and product are to have 2 components at each " // &
            "of " // to_text(size(self%contact, 2)) // " nodes")
      end if
      if (allocated(error)) return
      do k = 1, self%near%n
         associate (item => self%near%item(k))
            do j = 1, item%n_node
               do i = 1, item%n_node
                  product(:, item%node(i)) = product(:, item%node(i)) + factor(k)*matmul( &
                     item%h(2*i - 1:2*i, 2*j - 1:2*j), direction(:, item%node(j)))
               end do
            end do
         end associate
      end do
   end subroutine query_curvature_times

   !> Null-space matrix P, and DF of the reparametrisation, for the constraints that act in the last
   !> evaluation: P^T G^T = 0 and C DF = 0 for their discrete gradients G and their gradients at the
   !> end C, over all degrees of freedom, with the linear links in them.
   subroutine query_null_space(self, p, d, error)
      type(query_t), intent(inout) :: self
      type(csr_t), intent(out) :: p, d               !! (2 n_node x independent unknowns)
      type(error_t), allocatable, intent(out) :: error
      type(csr_t) :: links

      self%has_null_space = .false.
      if (.not. self%is_evaluated) call raise(error, err_input, &
         "no step was evaluated since the model was made, its unknowns changed, or " // &
         "constraints were asked for")
      if (allocated(error)) return
      associate (set => self%march%active%set, system => self%march%system, &
            null_space => self%null_space)
         call links_of(system, links)
         if (set%n == 0) then
            p = links
            d = links
            self%has_null_space = .true.
            return
         end if
         call null_space_matrices(null_space, set, system%space%numbering)
         select case (null_space%obstacle)
         case (obstacle_none)
            call csr_product(links, null_space%p, p)
            call csr_product(links, null_space%d, d)
            self%has_null_space = .true.
         case (obstacle_redundant)
            call raise(error, err_analysis, "there is no null space: some of the constraints " // &
               "that act follow from others")
         case default
            call raise(error, err_analysis, "there is no null space: an active constraint has " // &
               "no unknown that is fit to be eliminated")
         end select
      end associate
   end subroutine query_null_space

   !> The multipliers that the residual of the last evaluation without contact forces amounts to, by
   !> the dependent unknowns of the last null space. Those of constraints that do not act are 0.
   subroutine query_multipliers(self, lam, error)
      type(query_t), intent(in) :: self
      real(wp), intent(out) :: lam(:)                !! (n_constraint) [M L/T^2]
      type(error_t), allocatable, intent(out) :: error
      real(wp), allocatable :: residual(:), active(:)

      lam = 0.0_wp
      if (.not. (self%is_evaluated .and. self%has_null_space)) then
         call raise(error, err_input, "there is no null space of the last evaluation")
      else if (size(lam) /= self%march%system%n_constraint) then
         call raise(error, err_input, "lam is to have " // &
            to_text(self%march%system%n_constraint) // " entries, not " // to_text(size(lam)))
      end if
      if (allocated(error) .or. self%march%active%set%n == 0) return
      associate (set => self%march%active%set, system => self%march%system)
         allocate(residual(system%space%numbering%n_unknown), active(set%n))
         call pick_unknowns(system%space%numbering, system%response%residual, residual)
         call null_space_multipliers(self%null_space, set, system%space%numbering, residual, active)
         lam(set%id) = active
      end associate
   end subroutine query_multipliers

   !> T: all displacements from the unknowns, u = T q up to prescribed motion. A row of a prescribed
   !> freedom is empty, one of a dependent freedom holds the weights of those that it follows.
   subroutine query_links(stepper, links, error)
      type(stepper_t), intent(in) :: stepper
      type(csr_t), intent(out) :: links              !! (2 n_node x n_unknown)
      type(error_t), allocatable, intent(out) :: error

      call stepper_check_open(stepper, error)
      if (.not. allocated(error)) call links_of(stepper%march%system, links)
   end subroutine query_links

   subroutine links_of(system, links)
      type(system_t), intent(in) :: system
      type(csr_t), intent(out) :: links
      integer :: d

      call numbering_matrix(system%space%numbering, [(d, d = 1, 2*size(system%space%body))], links)
   end subroutine links_of

end module emcon_stepper_constraints
