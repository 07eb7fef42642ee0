!> The null space of the constraints that act in the last evaluation, and the linear links, asked
!> for from outside. Source: docs/theory.md, section 5.
module emcon_stepper_null_space
   use emcon_constraint_rows, only : constraints_rows
   use emcon_csr, only : csr_multiply, csr_t
   use emcon_csr_product, only : csr_product
   use emcon_errors, only : err_analysis, error_t, raise
   use emcon_kinds, only : wp
   use emcon_march_guess, only : follow_links
   use emcon_motion, only : at_rest
   use emcon_null_space, only : null_space_matrices, null_space_multipliers, &
      null_space_particular, obstacle_none, obstacle_redundant
   use emcon_numbering, only : gather_dependent, numbering_links, pick_unknowns
   use emcon_stepper, only : stepper_t
   use emcon_stepper_check, only : check_field, check_list, check_that, stepper_check_open
   use emcon_stepper_query, only : query_t
   implicit none
   private
   public :: query_null_space, query_multipliers, query_row_multipliers, query_particular
   public :: query_links, query_follow_links, query_gather_links

contains

   !> Null-space matrix P, and DF of the reparametrisation, for the constraints that act in the last
   !> evaluation: P^T G^T = 0 and C DF = 0 for their discrete gradients G and their gradients at the
   !> end C, over all degrees of freedom, with the linear links in them.
   !>
   !> `redundant`: places of constraints that follow from others, for `query_drop`; then there are
   !> no matrices.
   subroutine query_null_space(self, p, df, redundant, error)
      type(query_t), intent(inout) :: self
      type(csr_t), intent(out) :: p, df              !! (2 n_node x independent unknowns)
      integer, allocatable, intent(out) :: redundant(:)
      type(error_t), allocatable, intent(out) :: error
      type(csr_t) :: links

      self%has_null_space = .false.
      if (.not. allocated(self%null_space)) allocate(self%null_space)
      allocate(redundant(0))
      call check_that(self%has_set, "no step was evaluated since the model was made, its " // &
         "unknowns changed, or constraints were selected", error)
      call check_that(.not. allocated(self%map), "P and DF are of the freedoms of the nodes, not " &
         // "of the unknowns of a map: solve with the multipliers", error)
      if (allocated(error)) return
      associate (set => self%march%active%set, system => self%march%system, &
            null_space => self%null_space)
         call numbering_links(system%space%numbering, links)
         if (set%n == 0) then
            p = links
            df = links
            self%has_null_space = .true.
            return
         end if
         call constraints_rows(set, system%space%numbering)
         call null_space_matrices(null_space, set, system%space%numbering)
         select case (null_space%obstacle)
         case (obstacle_none)
            call csr_product(links, null_space%p, p)
            call csr_product(links, null_space%d, df)
            self%has_null_space = .true.
         case (obstacle_redundant)
            redundant = null_space%rows%redundant(:null_space%rows%n_redundant)
         case default
            call raise(error, err_analysis, "there is no null space: an active constraint has " // &
               "no unknown that is fit to be eliminated; solve with the multipliers")
         end select
      end associate
   end subroutine query_null_space

   !> The multipliers that a residual without contact forces amounts to, by the dependent unknowns
   !> of the last null space: `residual`, else that of the last `query_evaluate`. Those of
   !> constraints that do not act are 0.
   subroutine query_multipliers(self, stepper, lam, error, residual)
      type(query_t), intent(in) :: self
      type(stepper_t), intent(in) :: stepper
      real(wp), allocatable, intent(out) :: lam(:)             !! (n_constraint) [M L/T^2]
      type(error_t), allocatable, intent(out) :: error
      real(wp), intent(in), optional :: residual(:, :)         !! (2, n_node) [M L/T^2]
      real(wp), allocatable :: row(:)

      call query_row_multipliers(self, stepper, row, error, residual)
      if (allocated(error)) return
      associate (set => self%march%active%set)
         allocate(lam(self%march%system%n_constraint), source=0.0_wp)
         lam(set%id(:set%n)) = row(:set%n)
      end associate
   end subroutine query_multipliers

   !> The same for the rows of the set, in their order.
   subroutine query_row_multipliers(self, stepper, lam, error, residual)
      type(query_t), intent(in) :: self
      type(stepper_t), intent(in) :: stepper
      real(wp), allocatable, intent(out) :: lam(:)             !! (n_row) [M L/T^2]
      type(error_t), allocatable, intent(out) :: error
      real(wp), intent(in), optional :: residual(:, :)         !! (n_dim, n_node) [M L/T^2]
      real(wp), allocatable :: of_unknown(:)

      call check_null_space(self, error)
      if (present(residual)) call check_field("residual", residual, stepper%scene, error)
      call check_that(present(residual) .or. self%is_evaluated, &
         "the last evaluation has no residual: give one", error)
      if (allocated(error)) return
      associate (set => self%march%active%set, system => self%march%system)
         allocate(lam(set%n_row), source=0.0_wp)
         if (set%n_row == 0) return
         allocate(of_unknown(system%space%numbering%n_unknown))
         if (present(residual)) then
            call pick_unknowns(system%space%numbering, residual, of_unknown)
         else
            call pick_unknowns(system%space%numbering, system%response%residual, of_unknown)
         end if
         call null_space_multipliers(self%null_space, set, system%space%numbering, of_unknown, &
            lam)
      end associate
   end subroutine query_row_multipliers

   !> The motion of dependent unknowns alone that closes `defect` to first order, by the last null
   !> space; Newton's step is this plus DF times that of the others.
   subroutine query_particular(self, stepper, defect, du, error)
      type(query_t), intent(in) :: self
      type(stepper_t), intent(in) :: stepper
      real(wp), intent(in) :: defect(:)                        !! (n) [L]
      real(wp), allocatable, intent(out) :: du(:, :)           !! (2, n_node) [L]
      type(error_t), allocatable, intent(out) :: error
      type(csr_t) :: links
      real(wp), allocatable :: dw(:), flat(:)

      call check_null_space(self, error)
      call check_list("defect", defect, self%march%active%set%n_row, error)
      if (allocated(error)) return
      allocate(du, source=at_rest(stepper%scene%x))
      if (size(defect) == 0) return
      allocate(dw(self%march%system%space%numbering%n_unknown), flat(size(du)))
      call null_space_particular(self%null_space%gap, defect, dw)
      call numbering_links(self%march%system%space%numbering, links)
      call csr_multiply(links, dw, flat)
      du = reshape(flat, shape(du))
   end subroutine query_particular

   subroutine check_null_space(self, error)
      type(query_t), intent(in) :: self
      type(error_t), allocatable, intent(inout) :: error

      call check_that(self%has_null_space, "there is no null space of the last evaluation", error)
   end subroutine check_null_space

   !> T: all displacements from the unknowns, u = T q up to prescribed motion. A row of a prescribed
   !> freedom is empty, one of a dependent freedom holds the weights of those that it follows.
   subroutine query_links(stepper, matrix, error)
      type(stepper_t), intent(in) :: stepper
      type(csr_t), intent(out) :: matrix             !! (2 n_node x n_unknown)
      type(error_t), allocatable, intent(out) :: error

      call stepper_check_open(stepper, error)
      if (.not. allocated(error)) call numbering_links( &
         stepper%march%system%space%numbering, matrix)
   end subroutine query_links

   !> Dependent freedoms of a displacement or velocity from those that they follow.
   subroutine query_follow_links(stepper, field, error)
      type(stepper_t), intent(in) :: stepper
      real(wp), intent(inout), contiguous :: field(:, :)       !! (2, n_node)
      type(error_t), allocatable, intent(out) :: error

      call stepper_check_open(stepper, error)
      call check_field("field", field, stepper%scene, error)
      if (.not. allocated(error)) call follow_links(stepper%march%system, field)
   end subroutine query_follow_links

   !> Forces on dependent freedoms go to those that they follow.
   subroutine query_gather_links(stepper, field, error)
      type(stepper_t), intent(in) :: stepper
      real(wp), intent(inout), contiguous :: field(:, :)       !! (2, n_node)
      type(error_t), allocatable, intent(out) :: error

      call stepper_check_open(stepper, error)
      call check_field("field", field, stepper%scene, error)
      if (allocated(error)) return
      associate (space => stepper%march%system%space)
         if (space%linear%n > 0) call gather_dependent(space%linked, field)
      end associate
   end subroutine query_gather_links

end module emcon_stepper_null_space
