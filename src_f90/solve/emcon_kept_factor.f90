! build: streams
!> Corrections of a step by a factor that is kept over many steps.
!>
!> L L^T is the symmetric part of an earlier tangent without constraints. With G the gradients of
!> the active constraints and W = L^-1 G^T a correction is
!>
!>    dq = L^-T (y + W mu),  y = -L^-1 r,  W^T W mu = -defect - W^T y
!>
!> which is zero only where residual and defects are: the age of L makes the way longer, not its
!> end another one. Source: docs/theory.md, section 8.
module emcon_kept_factor
   use emcon_constraint, only : condition_t
   use emcon_constraints, only : constraint_set_t
   use emcon_csr, only : csr_find, csr_t
   use emcon_diagonal_blocks, only : blocks_analyse, blocks_factorise, blocks_free, blocks_reach, &
      blocks_solve, diagonal_blocks_t
   use emcon_errors, only : error_t
   use emcon_kinds, only : dp, wp
   use emcon_lapack, only : dense_cholesky, dense_cholesky_solve
   use emcon_numbering, only : numbering_t
   use emcon_solver_registry, only : solver_create
   use emcon_sparse_solver, only : matrix_definite, sparse_solver_t
   implicit none
   private
   public :: kept_factor_t, kept_factor_set_up, kept_factor_renew, kept_factor_take, &
      kept_factor_look, kept_factor_serves, kept_factor_correct, kept_factor_forget, &
      kept_factor_free, kept_factor_is_possible, kept_factor_has_room, kept_factor_multipliers, &
      kept_factor_reach, kept_factor_condense

   !> The stiffness that a constraint has by its curvature may be so large a part of that of the
   !> unknowns it stands on: at a kink, which has as much as one likes, no kept factor converges.
   real(dp), parameter :: most_curved = 0.5_dp
   !> Multipliers of a first guess may be several times too large.
   real(dp), parameter :: most_curved_far = 4.0_dp*most_curved
   !> A contact that gives way is that much softer or stiffer than what it pushes at, at most.
   real(dp), parameter :: rounding = 64.0_dp*epsilon(1.0_dp)

   type :: kept_factor_t
      logical :: is_made = .false.               !! there is a factor
      type(diagonal_blocks_t) :: blocks          !! one for each part that hangs together
      !> W^T W may have so many times the entries of the matrix.
      integer :: most_products = 4
      integer :: n_renewal = 0                   !! factors made so far
      integer :: n_forward = 0                   !! columns of W made so far
      integer, private :: n_slot = 0                 !! of the matrix
      real(dp), allocatable, private :: diagonal(:)  !! (n_unknown)
      ! W of the constraints last taken, by its entries that are not zero:
      integer, allocatable, private :: start(:)      !! (n + 1) entries before each column
      integer, allocatable, private :: index(:)      !! (>= start(n + 1)) rows, from 0
      real(dp), allocatable, private :: w(:)         !! (>= start(n + 1))
      real(dp), allocatable, private :: l(:, :)      !! (n, n) Cholesky factor of W^T W
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
   end subroutine kept_factor_set_up

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

   !> Free what the solvers hold.
   subroutine kept_factor_free(self)
      type(kept_factor_t), intent(inout) :: self

      call kept_factor_forget(self)
      call blocks_free(self%blocks)
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
      call blocks_analyse(self%blocks, matrix, is_new, error)
      if (allocated(error)) return
      if (.not. self%blocks%is_symmetric) return
      if (is_new) call lay_out(self, matrix)
      do k = 1, matrix%n_row
         self%diagonal(k) = matrix%value(csr_find(matrix, k, k))
      end do
      call blocks_factorise(self%blocks, matrix, is_singular, error)
      if (allocated(error)) return
      self%is_made = .not. is_singular
      self%n_renewal = self%n_renewal + 1
   end subroutine kept_factor_renew

   !> Room for matrices of the pattern of `matrix`.
   pure subroutine lay_out(self, matrix)
      type(kept_factor_t), intent(inout) :: self
      type(csr_t), intent(in) :: matrix

      self%n_slot = size(matrix%column)
      if (allocated(self%y)) deallocate(self%y, self%x, self%diagonal, self%index, self%w)
      associate (n => matrix%n_row)
         allocate(self%y(n), self%x(n), self%diagonal(n), self%index(n), self%w(n))
      end associate
   end subroutine lay_out

   !> May `n` constraints be taken, by the factor there is or a new one?
   pure logical function kept_factor_has_room(self, n, n_entry)
      type(kept_factor_t), intent(in) :: self
      integer, intent(in) :: n                   !! >= 0
      integer, intent(in) :: n_entry             !! of the matrix that a new one would be of

      kept_factor_has_room = n**2 <= self%most_products*merge(self%n_slot, n_entry, self%is_made)
   end function kept_factor_has_room

   !> Take the constraints of `set` at their present gradients.
   subroutine kept_factor_take(self, set, is_fit, error)
      type(kept_factor_t), intent(inout) :: self
      type(constraint_set_t), intent(in) :: set
      logical, intent(out) :: is_fit             !! there is a factor, and one of W^T W, not t
      type(error_t), allocatable, intent(out) :: error

      is_fit = self%is_made .and. kept_factor_has_room(self, set%n_row, self%n_slot)
      if (.not. is_fit) return
      call reach_rows(self, set, error)
      if (allocated(error)) return
      if (set%penalty%is_on) then
         self%product = self%l
         self%compliance = spread(0.0_dp, 1, set%n_row)
         call add_penalty(self, set, is_fit)
      else
         call dense_cholesky(self%l, is_fit)
      end if
   end subroutine kept_factor_take

   !> The constraints of `set` in their multipliers alone, by the factor there is: their values
   !> after a correction are free + w lam.
   subroutine kept_factor_condense(self, set, residual, w, free, error)
      type(kept_factor_t), intent(inout) :: self         !! with a factor that has room for the set
      type(constraint_set_t), intent(in) :: set
      real(wp), intent(in), contiguous :: residual(:)    !! (n_unknown) without contact forces
      real(wp), intent(out) :: w(:, :)                   !! (n, n) [T^2/M]
      real(wp), intent(out) :: free(:)                   !! (n) [L]
      type(error_t), allocatable, intent(out) :: error
      integer :: k, j

      call reach_rows(self, set, error)
      if (allocated(error)) return
      self%x = -real(residual, dp)
      call blocks_solve(self%blocks, .false., self%x, self%y, error)
      if (allocated(error)) return
      do k = 1, set%n_row
         w(k:, k) = real(self%blocks%scale*self%l(k:, k), wp)
         w(k, k:) = w(k:, k)
         free(k) = set%defect(k)
         do j = self%start(k) + 1, self%start(k + 1)
            free(k) = free(k) + real(self%blocks%scale*self%w(j)*self%y(self%index(j) + 1), wp)
         end do
      end do
   end subroutine kept_factor_condense

   !> W of the constraints at their present gradients, and W^T W.
   subroutine reach_rows(self, set, error)
      type(kept_factor_t), intent(inout) :: self         !! with a factor
      type(constraint_set_t), intent(in) :: set
      type(error_t), allocatable, intent(out) :: error
      integer :: k, n

      if (allocated(self%l)) then
         if (size(self%mu) /= set%n_row) deallocate(self%l, self%mu, self%start, self%bend)
      end if
      if (.not. allocated(self%l)) allocate(self%l(set%n_row, set%n_row), self%mu(set%n_row), &
         self%start(set%n_row + 1), self%bend(set%n_row))
      self%start(1) = 0
      do k = 1, set%n_row
         call make_room(self, self%start(k) + size(self%y))
         associate (rows => set%gap_rows, first => set%gap_rows%row_start(k) + 1, &
               last => set%gap_rows%row_start(k + 1), at => self%start(k) + 1)
            call blocks_reach(self%blocks, rows%column(first:last), rows%value(first:last), n, &
               self%index(at:), self%w(at:), error)
         end associate
         if (allocated(error)) return
         self%start(k + 1) = self%start(k) + n
      end do
      self%n_forward = self%n_forward + set%n_row
      call fill_products(self)
   end subroutine reach_rows

   !> Factorise W^T W with the compliance of contacts that give way, for their present slopes: none
   !> without slope pushes, and all are soft enough for the factor.
   subroutine add_penalty(self, set, is_fit)
      type(kept_factor_t), intent(inout) :: self
      type(constraint_set_t), intent(in) :: set
      logical, intent(out) :: is_fit
      real(dp) :: stiffness
      integer :: k

      self%l = self%product
      do k = set%n_permanent + 1, set%n
         associate (diagonal => self%l(k, k))
            stiffness = real(set%penalty%slope(k), dp)*self%blocks%scale*diagonal
            self%compliance(k) = diagonal*max(rounding, 1.0_dp/max(stiffness, rounding))
            diagonal = diagonal + self%compliance(k)
         end associate
      end do
      call dense_cholesky(self%l, is_fit)
   end subroutine add_penalty

   !> Room for `n` entries of W; what there is stays.
   pure subroutine make_room(self, n)
      type(kept_factor_t), intent(inout) :: self
      integer, intent(in) :: n
      integer, allocatable :: index(:)
      real(dp), allocatable :: w(:)

      if (n <= size(self%w)) return
      allocate(index(2*n), source=0)
      allocate(w(2*n), source=0.0_dp)
      index(:size(self%index)) = self%index
      w(:size(self%w)) = self%w
      call move_alloc(index, self%index)
      call move_alloc(w, self%w)
   end subroutine make_room

   !> W^T W, its lower triangle.
   pure subroutine fill_products(self)
      type(kept_factor_t), intent(inout) :: self
      integer :: k, i, j
      real(dp) :: total

      self%y = 0.0_dp
      do k = 1, size(self%mu)
         do j = self%start(k) + 1, self%start(k + 1)
            self%y(self%index(j) + 1) = self%w(j)
         end do
         do i = k, size(self%mu)
            total = 0.0_dp
            do j = self%start(i) + 1, self%start(i + 1)
               total = total + self%w(j)*self%y(self%index(j) + 1)
            end do
            self%l(i, k) = total
         end do
         do j = self%start(k) + 1, self%start(k + 1)
            self%y(self%index(j) + 1) = 0.0_dp
         end do
      end do
   end subroutine fill_products

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
      integer :: k, j
      logical :: is_fit

      if (set%penalty%is_on) call add_penalty(self, set, is_fit)
      self%x = -real(residual, dp)
      call blocks_solve(self%blocks, .false., self%x, self%y, error)
      if (allocated(error)) return
      do k = 1, set%n_row
         self%mu(k) = -real(set%defect(k), dp)/self%blocks%scale
         if (set%penalty%is_on) self%mu(k) = self%mu(k) &
            + self%compliance(k)*real(set%penalty%lack(k), dp)
         do j = self%start(k) + 1, self%start(k + 1)
            self%mu(k) = self%mu(k) - self%w(j)*self%y(self%index(j) + 1)
         end do
      end do
      call dense_cholesky_solve(self%l, self%mu)
      do k = 1, set%n_row
         do j = self%start(k) + 1, self%start(k + 1)
            self%y(self%index(j) + 1) = self%y(self%index(j) + 1) + self%mu(k)*self%w(j)
         end do
      end do
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
