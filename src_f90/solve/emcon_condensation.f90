!> A step linearised where it is, in the multipliers of its contacts alone.
!>
!> With the tangent A, the residual r, the directions F of forces and the gradients G of the values
!> of rows, the unknowns follow dq = A^-1 (F^T y - r), and the rows G dq + defect = free + W y. With
!> c F^T G in A, of rows that hold what nothing else does, multipliers gain y - c G dq, else y. By
!> the saddle point these are also all rows that always hold: a node of a rigid body that only they
!> hold has no mass.
!> Rows that always hold are eliminated first: their multipliers follow. A factor that is kept does
!> for A as well as its age lets it: the way to the end is longer then, and costs no factor.
!> Source: docs/theory.md, eq. (14i).
module emcon_condensation
   use emcon_constraint_rows, only : constraints_add_curvature, constraints_merge_pattern
   use emcon_constraints, only : constraint_set_t
   use emcon_correction, only : correction_t
   use emcon_csr, only : csr_find, csr_t
   use emcon_errors, only : error_t
   use emcon_kept_factor, only : kept_factor_condense, kept_factor_move, kept_factor_settle, &
      kept_factor_t
   use emcon_kinds, only : dp, wp
   use emcon_lapack, only : dense_solve
   use emcon_solver_registry, only : solver_create
   use emcon_sparse_solver, only : matrix_general, sparse_solver_t
   use emcon_steps, only : method_saddle_point
   use emcon_system, only : system_t
   implicit none
   private
   public :: condensation_t, condensation_make, condensation_renew, condensation_take, &
      condensation_move, condensation_free

   type :: condensation_t
      !> (n_row) c, the stiffness that rows have in A; not allocated: none [M/T^2]
      real(wp), allocatable :: hold(:)
      logical :: is_singular = .true.            !! something moves freely: nothing is known
      integer :: n_permanent = 0                 !! rows that always hold, the first ones
      real(wp), allocatable :: free(:)           !! (rows) values by no other multipliers [L]
      real(wp), allocatable :: w(:, :)           !! (rows, rows) and what they gain by them [T^2/M]
      !> (n_unknown, 0:rows) what moves by no other multipliers (0), and by one more of each row
      real(wp), allocatable, private :: motion(:, :)
      !> (n_permanent, 0:rows) multipliers of what always holds, as `motion`
      real(wp), allocatable, private :: permanent(:, :)
      logical, private :: is_by_kept = .false.   !! by a factor that is kept
      !> (n_row, n_row) what all rows gain by all by that factor [T^2/M]
      real(wp), allocatable, private :: all_w(:, :)
      !> (n_unknown, n_permanent) what moves by those rows alone, and their rates by it
      real(wp), allocatable, private :: held(:, :)
      real(dp), allocatable, private :: held_rate(:, :)
      class(sparse_solver_t), allocatable, private :: solver
      type(csr_t), private :: tangent
      !> c of rows that always hold [M/T^2]
      real(wp), private :: support = 0.0_wp
   end type condensation_t

contains

   !> Factorise the tangent and find out what forces of the rows of `set` move.
   subroutine condensation_make(self, system, set, correction, residual, has_curvature, error)
      type(condensation_t), intent(inout) :: self        !! keeps its orderings
      type(system_t), intent(in) :: system               !! with the tangent of its terms
      type(constraint_set_t), intent(in) :: set          !! evaluated, with rows
      type(correction_t), intent(in) :: correction       !! by the solver of which
      real(wp), intent(in) :: residual(:)                !! (n_unknown)
      logical, intent(in) :: has_curvature               !! the tangent has that of the rows
      type(error_t), allocatable, intent(out) :: error
      real(wp) :: force(size(residual))
      integer :: k

      self%n_permanent = set%n_permanent
      self%is_by_kept = .false.
      call assemble(self, system, set, has_curvature, correction%method == method_saddle_point)
      call factorise(self, correction, error)
      if (allocated(error) .or. self%is_singular) return
      if (allocated(self%motion)) deallocate(self%motion, self%held)
      if (allocated(self%w)) deallocate(self%permanent, self%w)
      associate (n => size(residual), first => set%n_permanent, last => set%n_row - set%n_permanent)
         allocate(self%held(n, first), self%motion(n, 0:last), self%permanent(first, 0:last), &
            self%w(last, last))
         force = -residual
         call self%solver%solve(force, self%motion(:, 0), error)
         do k = 1, set%n_row
            if (allocated(error)) return
            call spread_row(set%force_rows, k, force)
            if (k <= first) call self%solver%solve(force, self%held(:, k), error)
            if (k > first) call self%solver%solve(force, self%motion(:, k - first), error)
         end do
         if (allocated(error)) return
         call find_held_rate(self, set)
         call eliminate(self, set, 0, last)
         if (self%is_singular) return
         do k = 1, last
            self%w(:, k) = rates(set, first + 1, set%n_row, self%motion(:, k))
         end do
      end associate
   end subroutine condensation_make

   !> The same tangent where another residual and other defects are left: as the motion nears its
   !> end this is as good as a new one.
   subroutine condensation_renew(self, set, residual, error)
      type(condensation_t), intent(inout) :: self        !! made for these rows
      type(constraint_set_t), intent(in) :: set          !! evaluated, with rows
      real(wp), intent(in) :: residual(:)                !! (n_unknown)
      type(error_t), allocatable, intent(out) :: error

      call self%solver%solve(-residual, self%motion(:, 0), error)
      if (.not. allocated(error)) call eliminate(self, set, 0, 0)
   end subroutine condensation_renew

   !> The same by a factor that is kept, without the curvature of rows.
   subroutine condensation_take(self, kept, set, residual, is_new, error)
      type(condensation_t), intent(inout) :: self
      type(kept_factor_t), intent(inout) :: kept         !! with a factor that may condense the set
      type(constraint_set_t), intent(in) :: set          !! evaluated, with rows
      real(wp), intent(in), contiguous :: residual(:)    !! (n_unknown)
      logical, intent(in) :: is_new              !! else what rows gain is that of the last call
      type(error_t), allocatable, intent(out) :: error
      real(wp) :: free(set%n_row)

      associate (n => set%n_permanent, n_row => set%n_row)
         if (is_new) then
            self%n_permanent = n
            self%is_by_kept = .true.
            if (allocated(self%all_w)) deallocate(self%all_w)
            if (allocated(self%w)) deallocate(self%permanent, self%w)
            allocate(self%all_w(n_row, n_row), self%w(n_row - n, n_row - n), &
               self%permanent(n, 0:n_row - n))
            call kept_factor_condense(kept, set, residual, self%all_w, free, error)
         else
            call kept_factor_settle(kept, set, residual, free, error)
         end if
         if (.not. allocated(error)) call eliminate_from(self, free, n)
      end associate
   end subroutine condensation_take

   !> Let the first `n` rows hold, of which all have the values `free` by no more multipliers.
   subroutine eliminate_from(self, free, n)
      type(condensation_t), intent(inout) :: self
      real(wp), intent(in) :: free(:)            !! (n_row) [L]
      integer, intent(in) :: n
      real(dp), dimension(n, 0:size(free) - n) :: rate, lam

      self%is_singular = .false.
      self%free = free(n + 1:)
      self%w(:, :) = self%all_w(n + 1:, n + 1:)
      if (n == 0) return
      rate(:, 0) = real(free(:n), dp)
      rate(:, 1:) = real(self%all_w(:n, n + 1:), dp)
      call dense_solve(real(self%all_w(:n, :n), dp), rate, lam, self%is_singular)
      if (self%is_singular) return
      self%permanent = -real(lam, wp)
      self%free = self%free + matmul(self%all_w(n + 1:, :n), self%permanent(:, 0))
      self%w = self%w + matmul(self%all_w(n + 1:, :n), self%permanent(:, 1:))
   end subroutine eliminate_from

   !> The correction that `more` multipliers of contacts lead to, and those of what always holds.
   subroutine condensation_move(self, kept, more, dq, held, error)
      type(condensation_t), intent(in) :: self           !! not singular
      type(kept_factor_t), intent(inout) :: kept         !! that it was taken by, if by one
      real(wp), intent(in) :: more(:)                    !! (rows) [M L/T^2]
      real(wp), intent(out), contiguous :: dq(:)         !! (n_unknown) [L]
      real(wp), intent(out) :: held(:)                   !! (n_permanent) [M L/T^2]
      type(error_t), allocatable, intent(out) :: error

      held = self%permanent(:, 0) + matmul(self%permanent(:, 1:), more)
      if (self%is_by_kept) then
         call kept_factor_move(kept, [held, more], dq, error)
      else
         dq = self%motion(:, 0) + matmul(self%motion(:, 1:), more)
      end if
   end subroutine condensation_move

   !> What the rows that always hold gain by their own multipliers.
   subroutine find_held_rate(self, set)
      type(condensation_t), intent(inout) :: self
      type(constraint_set_t), intent(in) :: set
      integer :: k

      associate (n => set%n_permanent)
         if (allocated(self%held_rate)) deallocate(self%held_rate)
         allocate(self%held_rate(n, n))
         do k = 1, n
            self%held_rate(:, k) = real(rates(set, 1, n, self%held(:, k)), dp)
         end do
      end associate
   end subroutine find_held_rate

   !> The tangent of the terms, of laws, and of rows as far as it is wanted.
   subroutine assemble(self, system, set, has_curvature, supports)
      type(condensation_t), intent(inout) :: self
      type(system_t), intent(in) :: system
      type(constraint_set_t), intent(in) :: set
      logical, intent(in) :: has_curvature
      logical, intent(in) :: supports            !! what always holds is stiff in the tangent
      integer, allocatable :: slot(:)
      integer :: k

      call constraints_merge_pattern(set, system%matrix, self%tangent, slot, supports)
      do k = 1, size(slot)
         self%tangent%value(slot(k)) = system%matrix%value(k)
      end do
      ! Who solves for the multipliers of slips scales them with the normal force.
      if (has_curvature) call constraints_add_curvature(set, system%space%numbering, &
         self%tangent, .true.)
      self%support = 0.0_wp
      if (supports .and. set%n_permanent > 0) then
         self%support = real(maxval(abs(self%tangent%value)), wp)
         do k = 1, set%n_permanent
            call hold_row(set, k, self%support, self%tangent)
         end do
      end if
      if (.not. allocated(self%hold)) return
      do k = set%n_permanent + 1, set%n_row
         if (self%hold(k) > 0.0_wp) call hold_row(set, k, self%hold(k), self%tangent)
      end do
   end subroutine assemble

   !> Row `k` pushes back by `hold` times what it gains.
   pure subroutine hold_row(set, k, hold, tangent)
      type(constraint_set_t), intent(in) :: set
      integer, intent(in) :: k
      real(wp), intent(in) :: hold
      type(csr_t), intent(inout) :: tangent
      integer :: i, j, place

      associate (force => set%force_rows, gap => set%gap_rows)
         do i = force%row_start(k) + 1, force%row_start(k + 1)
            do j = gap%row_start(k) + 1, gap%row_start(k + 1)
               place = csr_find(tangent, force%column(i) + 1, gap%column(j) + 1)
               if (place > 0) tangent%value(place) = tangent%value(place) &
                  + real(hold, dp)*force%value(i)*gap%value(j)
            end do
         end do
      end associate
   end subroutine hold_row

   !> By the solver of `correction`.
   subroutine factorise(self, correction, error)
      type(condensation_t), intent(inout) :: self
      type(correction_t), intent(in) :: correction
      type(error_t), allocatable, intent(out) :: error

      if (.not. allocated(self%solver)) call solver_create(correction%choice, matrix_general, &
         self%solver, correction%user)
      call self%solver%analyse(self%tangent, error)
      if (.not. allocated(error)) call self%solver%factorise(self%tangent%value, error)
      if (.not. allocated(error)) self%is_singular = self%solver%is_singular
   end subroutine factorise

   !> Let the rows that always hold do so in the motions `first` to `last`, and find what is free.
   subroutine eliminate(self, set, first, last)
      type(condensation_t), intent(inout) :: self
      type(constraint_set_t), intent(in) :: set
      integer, intent(in) :: first, last                 !! 0: by no other multipliers
      real(dp), dimension(set%n_permanent, first:last) :: rate, lam
      integer :: k

      associate (n => self%n_permanent)
         if (n > 0) then
            do k = first, last
               rate(:, k) = real(rates(set, 1, n, self%motion(:, k)), dp)
            end do
            if (first == 0) rate(:, 0) = rate(:, 0) + real(set%defect(:n), dp)
            call dense_solve(self%held_rate, rate, lam, self%is_singular)
            if (self%is_singular) return
            self%motion(:, first:last) = self%motion(:, first:last) - matmul(self%held, &
               real(lam, wp))
            self%permanent(:, first:last) = -real(lam, wp)
            if (first == 0) self%permanent(:, 0) = self%permanent(:, 0) &
               + self%support*set%defect(:n)
         end if
         if (first == 0) self%free = set%defect(n + 1:set%n_row) + rates(set, n + 1, set%n_row, &
            self%motion(:, 0))
      end associate
   end subroutine eliminate

   !> The force of row `k` by a multiplier of 1.
   pure subroutine spread_row(rows, k, force)
      type(csr_t), intent(in) :: rows
      integer, intent(in) :: k
      real(wp), intent(out) :: force(:)                  !! (n_unknown)
      integer :: i

      force = 0.0_wp
      do i = rows%row_start(k) + 1, rows%row_start(k + 1)
         force(rows%column(i) + 1) = real(rows%value(i), wp)
      end do
   end subroutine spread_row

   !> What the rows `first` to `last` gain over a motion.
   pure function rates(set, first, last, motion) result(rate)
      type(constraint_set_t), intent(in) :: set
      integer, intent(in) :: first, last
      real(wp), intent(in) :: motion(:)                  !! (n_unknown) [L]
      real(wp) :: rate(last - first + 1)
      integer :: i, k

      rate = 0.0_wp
      associate (rows => set%gap_rows)
         do k = first, last
            do i = rows%row_start(k) + 1, rows%row_start(k + 1)
               rate(k - first + 1) = rate(k - first + 1) &
                  + real(rows%value(i), wp)*motion(rows%column(i) + 1)
            end do
         end do
      end associate
   end function rates

   !> Free what the solver holds.
   subroutine condensation_free(self)
      type(condensation_t), intent(inout) :: self

      if (allocated(self%solver)) call self%solver%free()
   end subroutine condensation_free

end module emcon_condensation
