!> Newton corrections of the constrained system, by null space or saddle point.
!>
!> Patterns and orderings are kept as long as the active constraints stand on the same unknowns.
module emcon_correction
   use emcon_constraint_rows, only : constraints_add_curvature, constraints_merge_pattern
   use emcon_constraints, only : constraint_set_t, constraints_are_gradients
   use emcon_csr, only : csr_t
   use emcon_diagonal_blocks, only : blocks_let_threads
   use emcon_errors, only : error_t
   use emcon_independent_rows, only : independent_rows_find
   use emcon_kept_factor, only : kept_factor_free, kept_factor_set_up, kept_factor_t
   use emcon_kinds, only : dp, int64, wp
   use emcon_memory, only : memory_factors, memory_go_on, memory_take
   use emcon_null_space, only : null_space_factorise, null_space_free, null_space_init, &
      null_space_multipliers, null_space_renew, null_space_solve, null_space_t, &
      null_space_update, obstacle_fill, obstacle_none, obstacle_pivot
   use emcon_saddle_point, only : saddle_point_factorise, saddle_point_free, saddle_point_init, &
      saddle_point_reset, saddle_point_solve, saddle_point_t
   use emcon_solver_registry, only : solver_create, solver_default
   use emcon_sparse_solver, only : matrix_definite, sparse_solver_t
   use emcon_steps, only : method_null_space
   use emcon_system, only : system_t
   use emcon_tangent_factors, only : tangent_factors_create, tangent_factors_free, &
      tangent_factors_make, tangent_factors_solve, tangent_factors_t
   use emcon_timer, only : stopwatch_start, stopwatch_stop, stopwatch_t
   implicit none
   private
   public :: correction_t, correction_lay_out, correction_factorise, correction_solve, &
      correction_try_minimum, correction_is_lost, &
      correction_multipliers, correction_reset, correction_free, correction_reason, &
      correction_take_modes, correction_ticks, correction_work, correction_let_threads

   !> Of a correction by Newton's method, where the solver iterates.
   real(dp), parameter :: newton_accuracy = 1.0e-4_dp

   !> Patterns, and the constraint rows that they are for.
   type :: layout_t
      type(csr_t) :: merged                      !! N with constraints
      integer, allocatable :: slot(:)            !! entries of the system's matrix in `merged`
      integer, allocatable :: row_start(:), column(:)   !! constraint rows that the layout is for
      integer, allocatable :: law_start(:), law_column(:)   !! and those of laws alone
      logical :: is_merged = .false.             !! `merged` is laid out for these rows
      logical :: has_saddle_point = .false.      !! it is laid out for these rows
   end type layout_t

   type :: correction_t
      integer :: method = method_null_space      !! as the deck asks
      integer :: n_redundant = 0                 !! constraints that depend on earlier ones
      integer, allocatable :: redundant(:)       !! (n_redundant) their places in the set
      logical, allocatable :: is_near(:)         !! (n_redundant) they depend on others nearly only
      logical :: uses_null_space = .false.       !! for the last constraints
      logical :: knows_multipliers = .false.     !! for the last constraints: no unknowns
      logical :: fell_back = .false.             !! last factorisation: asked for, but not possible
      integer :: obstacle = obstacle_none        !! and why
      integer :: n_factorisation = 0             !! made so far
      integer :: choice = solver_default         !! of the direct solver, as the deck asks
      class(sparse_solver_t), allocatable :: user              !! by a program, for that choice
      type(tangent_factors_t) :: factors         !! no active constraint
      type(layout_t), private :: layout
      type(null_space_t) :: null_space
      type(kept_factor_t) :: kept                !! over increments
      type(saddle_point_t) :: saddle_point
      type(stopwatch_t), private :: clock        !! layouts and curvature of the constraints
      logical, private :: is_reduced = .false.   !! last factorisation: by null space
   end type correction_t

contains

   !> Forget all layouts: the numbering has changed.
   subroutine correction_reset(self, method, choice, user)
      type(correction_t), intent(inout) :: self
      integer, intent(in) :: method              !! one of `method_`
      integer, intent(in) :: choice              !! one of `solver_`, or above
      class(sparse_solver_t), intent(in), optional :: user     !! as in `solver_create`

      self%method = method
      self%choice = choice
      if (allocated(self%user)) deallocate(self%user)
      if (present(user)) allocate(self%user, source=user)
      call make_solvers(self)
      if (allocated(self%layout%row_start)) deallocate(self%layout%row_start, self%layout%column)
   end subroutine correction_reset

   subroutine make_solvers(self)
      type(correction_t), intent(inout) :: self

      call tangent_factors_create(self%factors, self%choice, self%user)
      self%factors%definite%accuracy = newton_accuracy
      call self%factors%definite%let_threads(self%kept%blocks%n_thread)
      call kept_factor_set_up(self%kept, self%choice, self%user)
      call tangent_factors_create(self%null_space%factors, self%choice, self%user)
      call saddle_point_reset(self%saddle_point, self%choice, self%user)
   end subroutine make_solvers

   !> Let `n` threads work on systems, to the same bits.
   pure subroutine correction_let_threads(self, n)
      type(correction_t), intent(inout) :: self
      integer, intent(in) :: n                   !! >= 1

      call blocks_let_threads(self%kept%blocks, n)
      if (allocated(self%factors%definite)) call self%factors%definite%let_threads(n)
   end subroutine correction_let_threads

   !> Tell solvers of definite matrices which motions take hardly any energy.
   pure subroutine correction_take_modes(self, mode)
      type(correction_t), intent(inout) :: self  !! reset
      real(dp), intent(in) :: mode(:, :)         !! (n_unknown, any)

      self%factors%definite%near_null = mode
   end subroutine correction_take_modes

   !> Free what the solvers hold.
   subroutine correction_free(self)
      type(correction_t), intent(inout) :: self

      if (.not. allocated(self%factors%general)) return
      call tangent_factors_free(self%factors)
      call kept_factor_free(self%kept)
      call null_space_free(self%null_space)
      call saddle_point_free(self%saddle_point)
   end subroutine correction_free

   !> Prepare for the active constraints at their present gradients; `n_redundant` > 0: some of
   !> them depend on others, and have to be dropped.
   subroutine correction_lay_out(self, system, set, goes_on)
      type(correction_t), intent(inout) :: self
      type(system_t), intent(in) :: system
      type(constraint_set_t), intent(in) :: set
      !> The next iterate of a solve whose choice of unknowns may stay; .false. if it is not given
      logical, intent(in), optional :: goes_on
      logical :: may_stay

      self%n_redundant = 0
      self%knows_multipliers = .true.
      if (set%n == 0) then
         self%fell_back = .false.
         if (set%n_condition == 0) return
         if (.not. has_pattern(self, set)) call take_pattern(self, set)
         return
      end if
      if (set%penalty%is_on) then
         call lay_out_penalty(self, system, set)
         return
      end if
      call stopwatch_start(self%clock)
      may_stay = .false.
      if (present(goes_on)) may_stay = goes_on
      associate (null_space => self%null_space)
         if (.not. has_pattern(self, set)) then
            call take_pattern(self, set)
            if (self%method == method_null_space) call null_space_init(null_space, set, &
               n_merged(system, set), system%space%numbering)
         else if (self%method == method_null_space .and. may_stay) then
            call null_space_renew(null_space, set, system%space%numbering)
         else if (self%method == method_null_space) then
            call null_space_update(null_space, set, system%space%numbering)
         end if
         self%uses_null_space = self%method == method_null_space
         if (self%uses_null_space) then
            self%uses_null_space = null_space%obstacle == obstacle_none
         else
            call independent_rows_find(null_space%rows, set, system%space%numbering)
         end if
         self%n_redundant = null_space%rows%n_redundant
         if (self%n_redundant > 0) then
            self%redundant = null_space%rows%redundant(:self%n_redundant)
            self%is_near = null_space%rows%is_near(:self%n_redundant)
         end if
      end associate
      self%knows_multipliers = tells_multipliers(self, set)
      call stopwatch_stop(self%clock)
   end subroutine correction_lay_out

   !> Does the null space of the constraints, for which there is a layout, tell their multipliers?
   !> One that is too full does.
   pure logical function tells_multipliers(self, set)
      type(correction_t), intent(in) :: self
      type(constraint_set_t), intent(in) :: set

      tells_multipliers = self%uses_null_space .or. (self%method == method_null_space &
         .and. .not. set%penalty%is_on .and. self%null_space%obstacle == obstacle_fill)
   end function tells_multipliers

   !> Contacts that give way depend on no others. Their null space is that of no contact: what they
   !> push is in the saddle point, or in the kept factor.
   subroutine lay_out_penalty(self, system, set)
      type(correction_t), intent(inout) :: self
      type(system_t), intent(in) :: system
      type(constraint_set_t), intent(in) :: set

      self%uses_null_space = .false.
      self%knows_multipliers = set%n_permanent == 0
      if (.not. has_pattern(self, set)) call take_pattern(self, set)
      if (set%n_permanent == 0) return
      associate (rows => self%null_space%rows)
         call independent_rows_find(rows, set, system%space%numbering)
         self%redundant = pack(rows%redundant(:rows%n_redundant), &
            rows%redundant(:rows%n_redundant) <= set%n_permanent)
         self%is_near = pack(rows%is_near(:rows%n_redundant), &
            rows%redundant(:rows%n_redundant) <= set%n_permanent)
         self%n_redundant = size(self%redundant)
      end associate
   end subroutine lay_out_penalty

   !> The constraints stand on the unknowns that the layout was made for.
   pure logical function has_pattern(self, set)
      type(correction_t), intent(in) :: self
      type(constraint_set_t), intent(in) :: set

      has_pattern = allocated(self%layout%row_start)
      if (has_pattern) has_pattern = is_pattern(self%layout%row_start, self%layout%column, &
         set%n_row, set%force_rows)
      if (has_pattern) has_pattern = is_pattern(self%layout%law_start, self%layout%law_column, &
         set%n_condition - set%n, set%law_rows)
   end function has_pattern

   !> Is this the pattern of the `n` rows?
   pure logical function is_pattern(start, column, n, rows)
      integer, intent(in) :: start(:), column(:)
      integer, intent(in) :: n
      type(csr_t), intent(in) :: rows            !! with values if `n` is above 0

      is_pattern = size(start) == n + 1
      if (.not. is_pattern .or. n == 0) return
      is_pattern = size(column) == rows%row_start(n + 1)
      if (is_pattern) is_pattern = all(start == rows%row_start(:n + 1))
      if (is_pattern) is_pattern = all(column == rows%column(:size(column)))
   end function is_pattern

   !> Entries of N with the constraints, at most: those of a constraint meet in pairs.
   pure integer function n_merged(system, set)
      type(system_t), intent(in) :: system
      type(constraint_set_t), intent(in) :: set

      associate (start => set%force_rows%row_start)
         n_merged = size(system%matrix%column) &
            + sum((start(2:set%n_row + 1) - start(:set%n_row))**2)
      end associate
      if (set%n_condition == set%n) return
      associate (start => set%law_rows%row_start)
         n_merged = n_merged + sum((start(2:) - start(:size(start) - 1))**2)
      end associate
   end function n_merged

   !> The layout is for these constraints from here on; that of matrices waits until it is wanted.
   subroutine take_pattern(self, set)
      type(correction_t), intent(inout) :: self
      type(constraint_set_t), intent(in) :: set

      self%layout%row_start = set%force_rows%row_start
      self%layout%column = set%force_rows%column(:set%force_rows%row_start(set%n_row + 1))
      if (set%n_condition > set%n) then
         self%layout%law_start = set%law_rows%row_start
         self%layout%law_column = &
            set%law_rows%column(:self%layout%law_start(size(self%layout%law_start)))
      else
         self%layout%law_start = [0]
         self%layout%law_column = [integer ::]
      end if
      self%layout%is_merged = .false.
      self%layout%has_saddle_point = .false.
   end subroutine take_pattern

   !> Factorise for the present tangent, gradients and multipliers. Where the null space turns out
   !> as poor it is the saddle point that is factorised.
   subroutine correction_factorise(self, system, set, is_singular, error)
      type(correction_t), intent(inout) :: self
      type(system_t), intent(in) :: system
      type(constraint_set_t), intent(in) :: set
      logical, intent(out) :: is_singular        !! there is no factor to solve with
      type(error_t), allocatable, intent(out) :: error
      logical :: is_symmetric                    ! the tangent with constraints

      self%n_factorisation = self%n_factorisation + 1
      self%factors%is_definite = .false.
      if (.not. allocated(self%factors%general)) call make_solvers(self)
      if (set%n_condition == 0) then
         call factorise_free(self, system, system%matrix, system%is_symmetric, is_singular, error)
         return
      end if
      is_singular = .true.
      if (self%n_redundant > 0) return
      call merge_all(self, system, set)
      is_symmetric = system%is_symmetric .and. constraints_are_gradients(set)
      if (set%n == 0) then
         call factorise_free(self, system, self%layout%merged, is_symmetric, is_singular, error)
         return
      end if
      self%is_reduced = self%method == method_null_space .and. .not. set%penalty%is_on
      self%obstacle = obstacle_none
      if (self%is_reduced) then
         call null_space_factorise(self%null_space, set, self%layout%merged, is_symmetric, &
            is_singular, error)
         if (allocated(error)) return
         self%obstacle = self%null_space%obstacle
         self%is_reduced = self%obstacle == obstacle_none
      end if
      self%fell_back = self%obstacle /= obstacle_none
      if (self%is_reduced) return
      if (.not. self%layout%has_saddle_point) then
         call saddle_point_init(self%saddle_point, set, self%layout%merged, error)
         if (allocated(error)) return
         self%layout%has_saddle_point = .true.
      end if
      call saddle_point_factorise(self%saddle_point, set, self%layout%merged, is_singular, error)
   end subroutine correction_factorise

   !> The tangent of the system with what constraints and laws of contact add to it.
   subroutine merge_all(self, system, set)
      type(correction_t), intent(inout) :: self
      type(system_t), intent(in) :: system
      type(constraint_set_t), intent(in) :: set
      integer :: k

      call stopwatch_start(self%clock)
      if (.not. self%layout%is_merged) call constraints_merge_pattern(set, system%matrix, &
         self%layout%merged, self%layout%slot)
      self%layout%is_merged = .true.
      self%layout%merged%value = 0.0_dp
      do k = 1, size(self%layout%slot)
         self%layout%merged%value(self%layout%slot(k)) = system%matrix%value(k)
      end do
      call constraints_add_curvature(set, system%space%numbering, self%layout%merged)
      call stopwatch_stop(self%clock)
   end subroutine merge_all

   !> Factorise a matrix as it is; a symmetric one that is not definite like any other.
   subroutine factorise_free(self, system, matrix, is_symmetric, is_singular, error)
      type(correction_t), intent(inout) :: self
      type(system_t), intent(in) :: system
      type(csr_t), intent(in) :: matrix          !! of the system, or with laws of contact
      logical, intent(in) :: is_symmetric
      logical, intent(out) :: is_singular
      type(error_t), allocatable, intent(out) :: error

      call memory_go_on(self%kept%memory)
      ! Minimum degree fills matrices of tied pieces by a quarter more than the pieces need.
      self%factors%general%seeks_less_fill = system%space%numbering%n_dependent > 0
      call tangent_factors_make(self%factors, matrix, is_symmetric, is_singular, error)
      call memory_take(self%kept%memory, memory_factors)
   end subroutine factorise_free

   !> Is the symmetric tangent of a system positive definite along what the constraints of `set`
   !> leave free? They are evaluated at the end of a static step: P is DF.
   subroutine correction_try_minimum(self, system, set, is_minimum, error)
      type(correction_t), intent(inout) :: self
      type(system_t), intent(in) :: system
      type(constraint_set_t), intent(in) :: set
      logical, intent(out) :: is_minimum         !! also where there is an error, or no null space
      type(error_t), allocatable, intent(out) :: error
      logical :: is_singular

      is_minimum = .true.
      if (set%n_condition == 0) then
         call try_matrix(self, system%matrix, is_minimum, error)
         return
      end if
      call correction_lay_out(self, system, set)
      if (self%n_redundant > 0 .or. .not. self%uses_null_space .or. set%n == 0) return
      call merge_all(self, system, set)
      call null_space_factorise(self%null_space, set, self%layout%merged, &
         system%is_symmetric .and. constraints_are_gradients(set), is_singular, error)
      if (allocated(error) .or. self%null_space%obstacle /= obstacle_none) return
      if (self%null_space%n_free > 0) call try_matrix(self, self%null_space%reduced, is_minimum, &
         error)
   end subroutine correction_try_minimum

   !> Is a symmetric matrix positive definite? Only factors tell.
   subroutine try_matrix(self, matrix, is_definite, error)
      type(correction_t), intent(inout) :: self
      type(csr_t), intent(in) :: matrix
      logical, intent(out) :: is_definite        !! also where there is an error
      type(error_t), allocatable, intent(out) :: error
      class(sparse_solver_t), allocatable :: factors

      is_definite = .true.
      self%n_factorisation = self%n_factorisation + 1
      call solver_create(self%choice, matrix_definite, factors, self%user)
      call factors%analyse(matrix, error)
      if (.not. allocated(error)) call factors%factorise(matrix%value, error)
      if (.not. allocated(error)) is_definite = .not. factors%is_singular
      call factors%free()
   end subroutine try_matrix

   !> Has the last solution found out that the matrix is singular?
   pure logical function correction_is_lost(self)
      type(correction_t), intent(in) :: self

      correction_is_lost = self%factors%is_definite .and. .not. self%factors%definite%is_converged
   end function correction_is_lost

   !> The multipliers that belong to `residual` (without contact forces), where the null space tells
   !> them: Newton's method by the saddle point has them as unknowns.
   subroutine correction_multipliers(self, system, set, residual)
      type(correction_t), intent(in) :: self
      type(system_t), intent(in) :: system
      type(constraint_set_t), intent(inout) :: set
      real(wp), intent(in), contiguous :: residual(:)      !! (n_unknown)

      if (set%n == 0 .or. .not. tells_multipliers(self, set)) return
      call null_space_multipliers(self%null_space, set, system%space%numbering, residual, set%lam)
   end subroutine correction_multipliers

   !> c.K c of the correction `dq` = c: the work along it of the forces that the tangent K tells,
   !> that of the last factorisation with constraints.
   pure real(wp) function correction_work(self, dq) result(work)
      type(correction_t), intent(in) :: self
      real(wp), intent(in), contiguous :: dq(:)            !! (n_unknown) [L]
      integer :: i, k

      work = 0.0_wp
      associate (tangent => self%layout%merged)
         do i = 1, size(dq)
            do k = tangent%row_start(i) + 1, tangent%row_start(i + 1)
               work = work + dq(i)*(real(tangent%value(k), wp)*dq(tangent%column(k) + 1))
            end do
         end do
      end associate
   end function correction_work

   !> Time spent on constraints so far, over what the system without them would take [ticks].
   pure integer(int64) function correction_ticks(self)
      type(correction_t), intent(in) :: self

      correction_ticks = self%clock%ticks + self%null_space%clock%ticks
   end function correction_ticks

   !> Why the last factorisation is of the saddle point although the null space was asked for.
   pure function correction_reason(self) result(text)
      type(correction_t), intent(in) :: self
      character(len=80) :: text

      select case (self%obstacle)
      case (obstacle_pivot)
         text = "an active constraint has no unknown that is fit to be eliminated"
      case (obstacle_fill)
         text = "so many active constraints are coupled that eliminating them costs more"
      case default
         text = ""
      end select
   end function correction_reason

   !> Correction `dq` of the unknowns, and for the saddle point that of the multipliers.
   subroutine correction_solve(self, set, residual, dq, dlam, error, accuracy)
      type(correction_t), intent(inout) :: self
      type(constraint_set_t), intent(in) :: set
      real(wp), intent(in), contiguous :: residual(:)      !! (n_unknown) with contact forces
      real(wp), intent(out), contiguous :: dq(:)           !! (n_unknown)
      real(wp), intent(out), contiguous :: dlam(:)         !! (n)
      type(error_t), allocatable, intent(out) :: error
      real(wp), intent(in), optional :: accuracy   !! > 0, that is enough where solutions need not
                                                   !! be exact, instead of `newton_accuracy`

      dlam = 0.0_wp
      if (set%n == 0) then
         self%factors%definite%accuracy = newton_accuracy
         call tangent_factors_solve(self%factors, residual, dq, error, accuracy)
         dq = -dq
      else if (self%is_reduced) then
         call null_space_solve(self%null_space, set, self%layout%merged, residual, dq, error)
      else
         call saddle_point_solve(self%saddle_point, set, residual, dq, dlam, error)
      end if
   end subroutine correction_solve

end module emcon_correction
