! build: streams
!> Corrections of a step by a factor that is kept over many steps.
!>
!> L L^T is the symmetric part of an earlier tangent without constraints. With G the gradients of
!> the active constraints and W = L^-1 G^T a correction is
!>
!>    dq = L^-T (y + W mu),  y = -L^-1 r,  W^T W mu = -defect - W^T y
!>
!> which is zero only where residual and defects are: the age of L makes the way longer, not its
!> end another one. Where contacts slide in space their forces are along F, not along G: there it is
!> V = L^-1 F^T that mu pushes by. Source: docs/theory.md, section 8.
module emcon_kept_factor
   use emcon_constraint, only : condition_t, most_slips
   use emcon_constraints, only : constraint_set_t
   use emcon_csr, only : csr_append, csr_find, csr_pick_rows, csr_t
   use emcon_diagonal_blocks, only : blocks_analyse, blocks_factorise, blocks_free, &
      blocks_has_panels, blocks_reach, blocks_reach_rows, blocks_solve, diagonal_blocks_t
   use emcon_errors, only : error_t
   use emcon_factor_rows, only : factor_rows_add, factor_rows_begin, factor_rows_fill_products, &
      factor_rows_make_room, factor_rows_subtract_products, factor_rows_t
   use emcon_gram_rows, only : gram_rows_free, gram_rows_take
   use emcon_kinds, only : dp, wp
   use emcon_lapack, only : dense_cholesky, dense_cholesky_solve, dense_lu, dense_lu_solve, &
      dense_lu_t
   use emcon_memory, only : memory_factors, memory_go_on, memory_t, memory_take
   use emcon_numbering, only : numbering_t
   use emcon_projected_gradients, only : projected_begin, projected_gradients_t, projected_solve
   use emcon_row_panels, only : row_panel_t
   use emcon_row_pool, only : row_pool_append, row_pool_find, row_pool_forget
   use emcon_solver_registry, only : solver_create
   use emcon_sparse_solver, only : matrix_definite, sparse_solver_t
   implicit none
   private
   public :: kept_factor_t, kept_factor_set_up, kept_factor_renew, kept_factor_take, &
      kept_factor_let_iterate, kept_factor_look, kept_factor_serves, kept_factor_correct, &
      kept_factor_forget, kept_factor_forget_rows, kept_factor_free, kept_factor_is_possible, &
      kept_factor_has_room, kept_factor_multipliers, kept_factor_reach, kept_factor_condense, &
      kept_factor_may_condense, kept_factor_most_iterated, kept_factor_settle, kept_factor_move

   !> The stiffness that a constraint has by its curvature may be so large a part of that of the
   !> unknowns it stands on: at a kink, which has as much as one likes, no kept factor converges.
   real(dp), parameter :: most_curved = 0.5_dp
   !> Multipliers of a first guess may be several times too large.
   real(dp), parameter :: most_curved_far = 4.0_dp*most_curved
   !> A contact that gives way is that much softer or stiffer than what it pushes at, at most.
   real(dp), parameter :: rounding = 64.0_dp*epsilon(1.0_dp)
   !> Of a correction by conjugate gradients: about what the age of a factor leaves.
   real(dp), parameter :: correction_accuracy = 1.0e-2_dp
   !> And of gaps in their multipliers alone: they tell which contacts act, and with two digits they
   !> tell it wrongly too often. So good are gradients of rows that are kept from set to set.
   real(dp), parameter :: condensed_accuracy = 1.0e-4_dp
   !> Operations of a row condensed by iterations, for each entry of the matrix: two times as many
   !> steps as a correction takes, beside which those of a complete factor are four times as fast.
   real(dp), parameter :: condensed_operations = 4.0_dp*14.0_dp*4.0_dp
   !> From so many constraints on they go through factors of dense blocks together.
   integer, parameter :: least_panels = 16
   !> So many times the rows of a set are kept at most.
   real(dp), parameter :: most_pool = 1.5_dp

   type :: kept_factor_t
      logical :: is_made = .false.               !! there is a factor
      type(diagonal_blocks_t) :: blocks          !! one for each part that hangs together
      !> W^T W may have so many times the entries of the matrix.
      integer :: most_products = 4
      integer :: n_renewal = 0                   !! factors made so far
      integer :: n_forward = 0                   !! columns of W made so far
      type(memory_t) :: memory                       !! of it, and of those that are not kept
      integer, private :: n_slot = 0                 !! of the matrix
      real(dp), allocatable, private :: diagonal(:)  !! (n_unknown)
      type(factor_rows_t), private :: rows           !! the constraints last taken
      !> W^T V of these, where forces have rows of their own
      type(dense_lu_t), allocatable, private :: lu
      !> Where the factor is incomplete:
      type(projected_gradients_t), allocatable, private :: gradients
      ! Of contacts that give way: W^T W, and what is added to its diagonal
      real(dp), allocatable, private :: product(:, :)   !! (n, n)
      real(dp), allocatable, private :: compliance(:)   !! (n)
      real(dp), allocatable, private :: y(:), x(:)   !! (n_unknown)
      real(dp), allocatable, private :: mu(:)        !! (n)
      real(dp), allocatable, private :: bend(:)      !! (n) of each, per multiplier [T^2/(M L)]
   end type kept_factor_t

contains

   !> Factors are to be made by solvers of `choice`; there is none any more.
   subroutine kept_factor_set_up(self, choice, user)
      type(kept_factor_t), intent(inout) :: self
      integer, intent(in) :: choice              !! one of `solver_`, or above
      class(sparse_solver_t), intent(in), optional :: user     !! as in `solver_create`

      if (allocated(self%blocks%kind)) then
         if (self%blocks%kind%choice /= choice) call blocks_free(self%blocks)
      end if
      call solver_create(choice, matrix_definite, self%blocks%kind, user)
      self%blocks%may_be_rough = .true.
      call kept_factor_forget(self)
      call kept_factor_let_iterate(self, .false.)
   end subroutine kept_factor_set_up

   !> May the factor be an incomplete one, by which corrections take conjugate gradients?
   subroutine kept_factor_let_iterate(self, may_iterate)
      type(kept_factor_t), intent(inout) :: self !! set up
      logical, intent(in) :: may_iterate         !! else it is a complete one

      if (may_iterate .eqv. self%blocks%accuracy > 0.0_dp) return
      call kept_factor_free(self)
      self%blocks%accuracy = merge(correction_accuracy, 0.0_dp, may_iterate)
   end subroutine kept_factor_let_iterate

   !> Can the solver make such factors?
   pure logical function kept_factor_is_possible(self)
      type(kept_factor_t), intent(in) :: self    !! set up

      kept_factor_is_possible = self%blocks%kind%has_halves()
   end function kept_factor_is_possible

   !> There is no factor any more.
   pure subroutine kept_factor_forget(self)
      type(kept_factor_t), intent(inout) :: self

      self%is_made = .false.
   end subroutine kept_factor_forget

   !> No row that a set had is of use for others, as in the next step: a run that is resumed there
   !> has none.
   pure subroutine kept_factor_forget_rows(self)
      type(kept_factor_t), intent(inout) :: self

      call row_pool_forget(self%rows%pool)
   end subroutine kept_factor_forget_rows

   !> Free what the solvers hold.
   subroutine kept_factor_free(self)
      type(kept_factor_t), intent(inout) :: self

      call kept_factor_forget(self)
      call blocks_free(self%blocks)
      if (allocated(self%gradients)) call gram_rows_free(self%gradients%rows)
   end subroutine kept_factor_free

   !> Factorise the symmetric part of `matrix`; `is_made` if it is definite, and the pattern is
   !> symmetric.
   subroutine kept_factor_renew(self, matrix, error)
      type(kept_factor_t), intent(inout) :: self
      type(csr_t), intent(in) :: matrix
      type(error_t), allocatable, intent(out) :: error
      logical :: is_new, is_singular
      integer :: k

      self%is_made = .false.
      call kept_factor_forget_rows(self)
      call memory_go_on(self%memory)
      call blocks_analyse(self%blocks, matrix, is_new, error)
      call memory_take(self%memory, memory_factors)
      if (allocated(error)) return
      if (.not. self%blocks%is_symmetric) return
      if (is_new) call lay_out(self, matrix)
      do k = 1, matrix%n_row
         self%diagonal(k) = matrix%value(csr_find(matrix, k, k))
      end do
      call blocks_factorise(self%blocks, matrix, is_singular, error)
      call memory_take(self%memory, memory_factors)
      if (allocated(error)) return
      self%is_made = .not. is_singular
      if (self%is_made .and. self%blocks%is_incomplete) then
         if (.not. allocated(self%gradients)) allocate(self%gradients)
         call projected_begin(self%gradients, self%diagonal)
         if (.not. allocated(self%gradients%rows%solver)) allocate(self%gradients%rows%solver, &
            source=self%blocks%kind)
      end if
      self%n_renewal = self%n_renewal + 1
   end subroutine kept_factor_renew

   !> Room for matrices of the pattern of `matrix`.
   pure subroutine lay_out(self, matrix)
      type(kept_factor_t), intent(inout) :: self
      type(csr_t), intent(in) :: matrix

      self%n_slot = size(matrix%column)
      if (allocated(self%y)) deallocate(self%y, self%x, self%diagonal)
      associate (n => matrix%n_row)
         allocate(self%y(n), self%x(n), self%diagonal(n))
         call factor_rows_make_room(self%rows, n)
      end associate
   end subroutine lay_out

   !> May `n` constraints be taken, by the factor there is or a new one? An incomplete one makes no
   !> dense matrix of them.
   pure logical function kept_factor_has_room(self, n, n_entry)
      type(kept_factor_t), intent(in) :: self
      integer, intent(in) :: n                   !! >= 0
      integer, intent(in) :: n_entry             !! of the matrix that a new one would be of

      kept_factor_has_room = (self%is_made .and. self%blocks%is_incomplete) .or. &
         n**2 <= self%most_products*merge(self%n_slot, n_entry, self%is_made)
   end function kept_factor_has_room

   !> Take the constraints of `set` at their present gradients, or, of many, at nearly these.
   subroutine kept_factor_take(self, set, is_exact, is_fit, error)
      type(kept_factor_t), intent(inout) :: self
      type(constraint_set_t), intent(in) :: set
      logical, intent(in) :: is_exact            !! at these: no other correction follows
      logical, intent(out) :: is_fit             !! there is a factor, and one of W^T W, not t
      type(error_t), allocatable, intent(out) :: error
      logical :: is_aside                        ! forces have rows of their own

      is_fit = self%is_made .and. kept_factor_has_room(self, set%n_row, self%n_slot) &
         .and. .not. (self%blocks%is_incomplete .and. set%penalty%is_on)
      if (.not. is_fit) return
      if (self%blocks%is_incomplete) then
         call begin_rows(self, set%n_row)
         call gram_rows_take(self%gradients%rows, set%gap_rows, set%n_row, self%gradients%root, &
            is_fit, error)
         return
      end if
      if (is_exact) call kept_factor_forget_rows(self)
      is_aside = .not. (is_exact .or. set%penalty%is_on)
      if (is_aside) is_aside = pushes_aside(set)
      call reach_rows(self, set, is_aside, condensed_accuracy, error)
      if (allocated(error)) return
      if (is_aside) then
         if (.not. allocated(self%lu)) allocate(self%lu)
         associate (n => set%n_row)
            call dense_lu(transpose(self%rows%l(n + 1:, :n)), self%lu, is_fit)
         end associate
         is_fit = .not. is_fit
      else if (set%penalty%is_on) then
         self%product = self%rows%l
         self%compliance = spread(0.0_dp, 1, set%n_row)
         call add_penalty(self, set, is_fit)
      else
         call dense_cholesky(self%rows%l, is_fit)
      end if
   end subroutine kept_factor_take

   !> Does some contact slide where slip has a direction? Its force is not along its gradient.
   pure logical function pushes_aside(set)
      type(constraint_set_t), intent(in) :: set
      integer :: k

      pushes_aside = .false.
      do k = set%n_permanent + 1, set%n
         associate (item => set%item(k))
            if (.not. item%has_friction .or. .not. allocated(item%t)) cycle
            pushes_aside = pushes_aside .or. (size(item%t, 3) == most_slips .and. &
               any(abs(item%response%mu_sigma) > 0.0_wp))
         end associate
      end do
   end function pushes_aside

   !> The constraints of `set` in their multipliers alone, by the factor there is: their values
   !> after a correction are free + w lam. By an incomplete factor both have some digits.
   subroutine kept_factor_condense(self, set, residual, w, free, error)
      type(kept_factor_t), intent(inout) :: self         !! with a factor that has room for the set
      type(constraint_set_t), intent(in) :: set
      real(wp), intent(in), contiguous :: residual(:)    !! (n_unknown) without contact forces
      real(wp), intent(out) :: w(:, :)                   !! (n, n) [T^2/M]
      real(wp), intent(out) :: free(:)                   !! (n) [L]
      type(error_t), allocatable, intent(out) :: error
      integer :: k

      if (self%blocks%is_incomplete) then
         self%x = -real(residual, dp)
         call condense_by_solutions(self, set, w, free, error)
         return
      end if
      call reach_rows(self, set, .false., condensed_accuracy, error)
      if (allocated(error)) return
      do k = 1, set%n_row
         w(k:, k) = real(self%blocks%scale*self%rows%l(k:, k), wp)
         w(k, k:) = w(k:, k)
      end do
      call kept_factor_settle(self, set, residual, free, error)
   end subroutine kept_factor_condense

   !> So many rows are condensed by iterations in the time that a complete factor takes.
   pure integer function kept_factor_most_iterated(self)
      type(kept_factor_t), intent(in) :: self    !! with an incomplete factor

      kept_factor_most_iterated = int(min(self%blocks%n_operation &
         /(condensed_operations*real(max(1, self%n_slot), dp)), 0.5_dp*huge(1)))
   end function kept_factor_most_iterated

   !> Can `n` rows be condensed, and be given more multipliers by `kept_factor_move`?
   pure logical function kept_factor_may_condense(self, n)
      type(kept_factor_t), intent(in) :: self
      integer, intent(in) :: n                   !! >= 0

      kept_factor_may_condense = self%is_made .and. .not. self%blocks%is_incomplete
      if (kept_factor_may_condense) kept_factor_may_condense = kept_factor_has_room(self, n, &
         self%n_slot)
   end function kept_factor_may_condense

   !> The values of the rows last condensed after a correction by no more multipliers.
   subroutine kept_factor_settle(self, set, residual, free, error)
      type(kept_factor_t), intent(inout) :: self         !! no incomplete factor
      type(constraint_set_t), intent(in) :: set          !! with as many rows
      real(wp), intent(in), contiguous :: residual(:)    !! (n_unknown)
      real(wp), intent(out) :: free(:)                   !! (n) [L]
      type(error_t), allocatable, intent(out) :: error
      real(dp) :: rate(set%n_row)

      self%x = -real(residual, dp)
      call blocks_solve(self%blocks, .false., self%x, self%y, error)
      if (allocated(error)) return
      rate = 0.0_dp
      call factor_rows_subtract_products(self%rows, -self%y, rate)
      free = set%defect(:set%n_row) + real(self%blocks%scale*rate, wp)
   end subroutine kept_factor_settle

   !> The correction by the rows last condensed, with `more` multipliers.
   subroutine kept_factor_move(self, more, dq, error)
      type(kept_factor_t), intent(inout) :: self         !! settled
      real(wp), intent(in) :: more(:)                    !! (n) [M L/T^2]
      real(wp), intent(out), contiguous :: dq(:)         !! (n_unknown) [L]
      type(error_t), allocatable, intent(out) :: error

      call factor_rows_add(self%rows, real(more, dp), self%y)
      call blocks_solve(self%blocks, .true., self%y, self%x, error)
      if (.not. allocated(error)) dq = real(self%blocks%scale*self%x, wp)
   end subroutine kept_factor_move

   !> The same by the motion of each multiplier, where the factor is incomplete. By the factor alone
   !> that would be so far off that other contacts act.
   subroutine condense_by_solutions(self, set, w, free, error)
      type(kept_factor_t), intent(inout) :: self         !! `x` is the load
      type(constraint_set_t), intent(in) :: set
      real(wp), intent(out) :: w(:, :)                   !! (n, n) [T^2/M]
      real(wp), intent(out) :: free(:)                   !! (n) [L]
      type(error_t), allocatable, intent(out) :: error
      real(dp) :: load(size(self%x))
      integer :: k
      logical :: is_fit

      self%gradients%accuracy = min(self%blocks%accuracy, condensed_accuracy)
      associate (gap_rows => set%gap_rows)
         call gram_rows_take(self%gradients%rows, gap_rows, 0, self%gradients%root, is_fit, error)
         if (allocated(error)) return
         load = self%x
         call projected_solve(self%gradients, self%blocks, [real(dp) ::], load, self%x, error)
         if (allocated(error)) return
         call multiply_rows(gap_rows, set%n_row, self%x, free)
         free = set%defect(:set%n_row) + free
         do k = 1, set%n_row
            load = 0.0_dp
            associate (first => gap_rows%row_start(k) + 1, last => gap_rows%row_start(k + 1))
               load(gap_rows%column(first:last) + 1) = gap_rows%value(first:last)
            end associate
            call projected_solve(self%gradients, self%blocks, [real(dp) ::], load, self%x, error)
            if (allocated(error)) return
            call multiply_rows(gap_rows, set%n_row, self%x, w(:, k))
         end do
      end associate
      w = 0.5_wp*(w + transpose(w))
   end subroutine condense_by_solutions

   !> G x of the first `n` rows.
   pure subroutine multiply_rows(rows, n, x, y)
      type(csr_t), intent(in) :: rows
      integer, intent(in) :: n
      real(dp), intent(in) :: x(:)
      real(wp), intent(out) :: y(:)              !! (n)
      integer :: k

      do k = 1, n
         associate (first => rows%row_start(k) + 1, last => rows%row_start(k + 1))
            y(k) = real(dot_product(rows%value(first:last), x(rows%column(first:last) + 1)), wp)
         end associate
      end do
   end subroutine multiply_rows

   !> W of the constraints, and W^T W, at gradients that are `part` off at most.
   subroutine reach_rows(self, set, is_aside, part, error)
      type(kept_factor_t), intent(inout) :: self         !! with a factor
      type(constraint_set_t), intent(in) :: set
      logical, intent(in) :: is_aside            !! also V of their forces, and V^T W alone
      real(dp), intent(in) :: part               !! by which gradients of rows may be others
      type(error_t), allocatable, intent(out) :: error
      integer :: n_push

      n_push = merge(set%n_row, 0, is_aside)
      call factor_rows_begin(self%rows, set%n_row + n_push, n_push)
      call begin_rows(self, set%n_row)
      if (set%n_row >= least_panels .and. blocks_has_panels(self%blocks)) then
         call reach_panels(self, set, part, error)
         return
      end if
      self%n_forward = self%n_forward + self%rows%n
      call reach_by_row(self, set%gap_rows, set%n_row, 0, error)
      if (allocated(error)) return
      if (is_aside) call reach_by_row(self, set%force_rows, n_push, set%n_row, error)
      if (.not. allocated(error)) call factor_rows_fill_products(self%rows, self%y)
   end subroutine reach_rows

   !> The first `n` of `rows`, row by row, behind those that are there.
   subroutine reach_by_row(self, rows, n, before, error)
      type(kept_factor_t), intent(inout) :: self
      type(csr_t), intent(in) :: rows            !! of unknowns
      integer, intent(in) :: n, before           !! of rows
      type(error_t), allocatable, intent(out) :: error
      integer :: k, n_entry

      do k = 1, n
         associate (start => self%rows%start, first => rows%row_start(k) + 1, &
               last => rows%row_start(k + 1))
            call factor_rows_make_room(self%rows, start(before + k) + size(self%y))
            associate (at => start(before + k) + 1)
               call blocks_reach(self%blocks, rows%column(first:last), rows%value(first:last), &
                  n_entry, self%rows%index(at:), self%rows%w(at:), error)
            end associate
            if (allocated(error)) return
            start(before + k + 1) = start(before + k) + n_entry
         end associate
      end do
   end subroutine reach_by_row

   !> Nothing is known of `n` rows yet.
   pure subroutine begin_rows(self, n)
      type(kept_factor_t), intent(inout) :: self
      integer, intent(in) :: n                   !! >= 0

      if (allocated(self%mu)) then
         if (size(self%mu) /= n) deallocate(self%mu, self%bend)
      end if
      if (.not. allocated(self%mu)) allocate(self%mu(n), self%bend(n))
      self%mu = 0.0_dp
      self%bend = 0.0_dp
   end subroutine begin_rows

   !> The same by panels: only of rows that the last sets did not have. Where these are many all are
   !> made anew, as the others would take room.
   subroutine reach_panels(self, set, part, error)
      type(kept_factor_t), intent(inout) :: self
      type(constraint_set_t), intent(in) :: set
      real(dp), intent(in) :: part
      type(error_t), allocatable, intent(out) :: error
      type(row_panel_t), allocatable :: panel(:)
      type(csr_t) :: all, rows
      integer :: name(self%rows%n)
      integer, allocatable :: missing(:)

      associate (pool => self%rows%pool, n => set%n_row)
         name(:n) = 2*((1 + most_slips)*set%id(set%condition) + set%slip) + 1
         all = set%gap_rows
         if (self%rows%n_push > 0) then
            name(n + 1:) = name(:n) + 1
            call csr_append(all, set%force_rows, n)
         end if
         call row_pool_find(pool, name, all, part, missing)
         if (size(missing) > 0 .and. real(pool%n + size(missing), dp) &
            > most_pool*self%rows%n) then
            call row_pool_forget(pool)
            call row_pool_find(pool, name, all, part, missing)
         end if
         if (size(missing) > 0) then
            call csr_pick_rows(all, missing, rows)
            call blocks_reach_rows(self%blocks, rows, size(missing), panel, error)
            if (allocated(error)) return
            call row_pool_append(pool, name, rows, missing, panel)
            self%n_forward = self%n_forward + size(missing)
         end if
      end associate
      self%rows%by_panels = .true.
      call factor_rows_fill_products(self%rows, self%y)
   end subroutine reach_panels

   !> Factorise W^T W with the compliance of contacts that give way, for their present slopes: none
   !> without slope pushes, and all are soft enough for the factor.
   subroutine add_penalty(self, set, is_fit)
      type(kept_factor_t), intent(inout) :: self
      type(constraint_set_t), intent(in) :: set
      logical, intent(out) :: is_fit
      real(dp) :: stiffness
      integer :: k

      self%rows%l = self%product
      do k = set%n_permanent + 1, set%n
         associate (diagonal => self%rows%l(k, k))
            stiffness = real(set%penalty%slope(k), dp)*self%blocks%scale*diagonal
            self%compliance(k) = diagonal*max(rounding, 1.0_dp/max(stiffness, rounding))
            diagonal = diagonal + self%compliance(k)
         end associate
      end do
      call dense_cholesky(self%rows%l, is_fit)
   end subroutine add_penalty

   !> Look at the second derivatives of the constraints last taken.
   pure subroutine kept_factor_look(self, set, numbering)
      type(kept_factor_t), intent(inout) :: self
      type(constraint_set_t), intent(in) :: set
      type(numbering_t), intent(in) :: numbering
      integer :: k

      self%bend = 0.0_dp
      do k = set%n_linear + 1, set%n
         self%bend(k) = bend_of(self, set%item(k), size(set%item(k)%g, 1)*set%item(k)%n_node, &
            numbering)
      end do
   end subroutine kept_factor_look

   !> The largest second derivative of a constraint among the unknowns, beside the stiffness of both
   !> that it joins, but for what the constraint itself takes up: forces along its gradient change
   !> its multiplier, and motions along it are none.
   pure real(dp) function bend_of(self, item, n, numbering)
      type(kept_factor_t), intent(in) :: self
      type(condition_t), intent(in) :: item
      integer, intent(in) :: n                   !! coordinates of its nodes
      type(numbering_t), intent(in) :: numbering
      real(dp) :: h(n, n), g(n), c(n), flexible(n)
      integer :: i, k, n_dim

      n_dim = size(item%g, 1)
      h = real(item%h(:n, :n), dp)
      g = real(reshape(item%g(:, :item%n_node), [n]), dp)
      c = real(reshape(item%c(:, :item%n_node), [n]), dp)
      do i = 1, n
         k = n_dim*(item%node((i - 1)/n_dim + 1) - 1) + modulo(i - 1, n_dim) + 1
         flexible(i) = flexibility(self, numbering%column(numbering%start(k) &
            + 1:numbering%start(k + 1)))
      end do
      if (any(flexible*abs(g) > 0.0_dp)) h = h - spread(g, 2, n) &
         *spread(matmul(flexible*g, h)/dot_product(flexible*g, g), 1, n)
      if (any(flexible*abs(c) > 0.0_dp)) h = h - spread(matmul(h, flexible*c) &
         /dot_product(flexible*c, c), 2, n)*spread(c, 1, n)
      bend_of = sqrt(maxval(h*h*spread(flexible, 2, n)*spread(flexible, 1, n)))
   end function bend_of

   !> One over the stiffness of the softest unknown that a coordinate follows; 0 if it follows none.
   pure real(dp) function flexibility(self, unknown)
      type(kept_factor_t), intent(in) :: self
      integer, intent(in) :: unknown(:)          !! <= 0: none
      integer :: i

      flexibility = 0.0_dp
      do i = 1, size(unknown)
         if (unknown(i) > 0) flexibility = max(flexibility, 1.0_dp/self%diagonal(unknown(i)))
      end do
   end function flexibility

   !> Is what the factor does not know, the curvature of the constraints as last looked at, small
   !> beside it, by their present multipliers? Those of contacts that give way follow the gaps, and
   !> are far too large where a first guess closes these: of them the last correction says what is
   !> left.
   pure logical function kept_factor_serves(self, set, is_near)
      type(kept_factor_t), intent(in) :: self
      type(constraint_set_t), intent(in) :: set
      logical, intent(in) :: is_near             !! the multipliers are about those of the solution
      real(dp) :: most, lam
      integer :: k

      kept_factor_serves = .true.
      most = merge(most_curved, most_curved_far, is_near)
      do k = set%n_linear + 1, set%n
         lam = real(set%lam(k), dp)
         if (set%penalty%is_on) lam = lam + self%mu(k)
         if (abs(lam)*self%bend(k) > most) kept_factor_serves = .false.
      end do
   end function kept_factor_serves

   !> The correction for `residual` (with contact forces) and the defects of the constraints last
   !> taken.
   subroutine kept_factor_correct(self, set, residual, dq, error)
      type(kept_factor_t), intent(inout) :: self
      type(constraint_set_t), intent(in) :: set
      real(wp), intent(in), contiguous :: residual(:)      !! (n_unknown)
      real(wp), intent(out), contiguous :: dq(:)           !! (n_unknown)
      type(error_t), allocatable, intent(out) :: error
      integer :: k
      logical :: is_fit

      if (self%blocks%is_incomplete) then
         self%y = -real(residual, dp)
         self%gradients%accuracy = self%blocks%accuracy
         call projected_solve(self%gradients, self%blocks, &
            real(set%defect(:set%n_row), dp), self%y, self%x, error)
         if (.not. allocated(error)) dq = real(self%x, wp)
         return
      end if
      if (set%penalty%is_on) call add_penalty(self, set, is_fit)
      self%x = -real(residual, dp)
      call blocks_solve(self%blocks, .false., self%x, self%y, error)
      if (allocated(error)) return
      do k = 1, set%n_row
         self%mu(k) = -real(set%defect(k), dp)/self%blocks%scale
         if (set%penalty%is_on) self%mu(k) = self%mu(k) &
            + self%compliance(k)*real(set%penalty%lack(k), dp)
      end do
      call factor_rows_subtract_products(self%rows, self%y, self%mu)
      if (self%rows%n_push > 0) then
         call dense_lu_solve(self%lu, self%mu)
      else
         call dense_cholesky_solve(self%rows%l, self%mu)
      end if
      call factor_rows_add(self%rows, self%mu, self%y)
      call blocks_solve(self%blocks, .true., self%y, self%x, error)
      if (allocated(error)) return
      dq = real(self%blocks%scale*self%x, wp)
   end subroutine kept_factor_correct

   !> How far things move by a multiplier of one, each.
   pure subroutine kept_factor_reach(self, reach)
      type(kept_factor_t), intent(in) :: self    !! that took contacts that give way
      real(wp), intent(out) :: reach(:)          !! (n) [T^2/M]
      integer :: k

      do k = 1, size(reach)
         reach(k) = real(self%blocks%scale*self%product(k, k), wp)
      end do
   end subroutine kept_factor_reach

   !> The multipliers of the last correction: matrix times `dq` is -residual + G^T mu.
   pure subroutine kept_factor_multipliers(self, mu)
      type(kept_factor_t), intent(in) :: self
      real(wp), intent(out) :: mu(:)             !! (n)

      mu = real(self%mu, wp)
   end subroutine kept_factor_multipliers

end module emcon_kept_factor
