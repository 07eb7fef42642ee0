!> Elimination of the multipliers: null-space matrix P and reparametrisation DF of a step.
!>
!> One unknown per active constraint becomes dependent. With the constraint rows split into
!> [G_u G_d], P = [I; -Gb_d^-1 Gb_u] from the discrete gradients and DF = [I; -G1_d^-1 G1_u] from
!> the gradients at the end; P^T N DF du = -P^T r is smaller than the saddle-point system, has no
!> zero block and needs no scale. Source: docs/theory.md, eqs. (18) to (20);
!> paper eqs. (5) and (7).
!>
!> Every decision here depends on the present gradients and the pattern only, so that a run does
!> not remember how it came to where it is.
module emcon_null_space
   use emcon_constraint, only : condition_row_force
   use emcon_constraints, only : constraint_set_t
   use emcon_csr, only : csr_multiply, csr_multiply_transposed, csr_t
   use emcon_dependent_block, only : dependent_block_factorise, dependent_block_init, &
      dependent_block_solve, dependent_block_t
   use emcon_errors, only : error_t
   use emcon_independent_rows, only : independent_rows_find, independent_rows_t
   use emcon_kinds, only : dp, int64, wp
   use emcon_null_basis, only : null_basis_fill, null_basis_init, null_basis_pattern, null_basis_t
   use emcon_numbering, only : numbering_t
   use emcon_solver_registry, only : solver_default
   use emcon_tangent_factors, only : tangent_factors_create, tangent_factors_free, &
      tangent_factors_make, tangent_factors_solve, tangent_factors_t
   use emcon_timer, only : stopwatch_start, stopwatch_stop, stopwatch_t
   use emcon_triple_product, only : triple_product_init, triple_product_t, triple_product_update
   implicit none
   private
   public :: null_space_t, null_space_init, null_space_update, null_space_renew, &
      null_space_factorise, null_space_solve, null_space_multipliers, null_space_matrices, &
      null_space_particular, null_space_free
   public :: obstacle_none, obstacle_redundant, obstacle_pivot, obstacle_fill

   !> Why the constraints cannot be eliminated.
   integer, parameter :: obstacle_none = 0, obstacle_redundant = 1, obstacle_pivot = 2, &
      obstacle_fill = 3
   !> The independent unknowns of coupled constraints all meet in P^T N DF. With more such pairs
   !> than this multiple of the entries of N, the larger system without them is clearly cheaper.
   integer, parameter :: most_fill = 1
   !> Refinements of the multipliers at most: a `dp` solution gains 16 digits or less each time.
   integer, parameter :: most_refinements = merge(4, 1, epsilon(1.0_wp) < epsilon(1.0_dp))

   !> A choice does for gradients that are other ones by this part: what was left of a row that is
   !> neither redundant nor near is a hundred times as much.
   real(dp), parameter :: alike = 1.0e-4_dp

   type :: null_space_t
      integer :: obstacle = obstacle_none
      type(independent_rows_t) :: rows           !! what is redundant, and the choice
      integer :: n_entry = 0                     !! of N
      integer :: n_free = 0                      !! independent unknowns
      type(dependent_block_t) :: present         !! Gb_d of the last `null_space_update`
      !> (2, entries) values of rows that `null_space_renew` has made a choice for
      real(dp), allocatable, private :: chosen_for(:, :)
      type(null_basis_t) :: basis                !! as of the last factorisation, like all below
      type(dependent_block_t) :: force, gap      !! Gb_d and G1_d
      type(csr_t) :: p                           !! (n_unknown x n_free)
      type(csr_t) :: d                           !! (n_unknown x n_free) DF
      type(csr_t) :: reduced                     !! P^T N DF
      type(triple_product_t) :: product
      type(tangent_factors_t) :: factors         !! of that
      type(stopwatch_t) :: clock                 !! P, DF and P^T N DF
      integer, allocatable :: owner(:)           !! (n_unknown) constraint of a dependent one, or 0
      real(wp), allocatable :: rhs(:), x(:)      !! (n_free)
      real(wp), allocatable :: part(:), image(:) !! (n_unknown)
   end type null_space_t

contains

   !> Begin with constraints of a new pattern: choose the dependent unknowns. P, DF and P^T N DF are
   !> laid out when it is factorised.
   subroutine null_space_init(self, set, n_entry, numbering)
      type(null_space_t), intent(inout) :: self
      type(constraint_set_t), intent(in) :: set
      integer, intent(in) :: n_entry                     !! of N, to compare with
      type(numbering_t), intent(in) :: numbering

      call begin(self, numbering%n_unknown, set%n_row)
      self%n_entry = n_entry
      call null_space_update(self, set, numbering)
   end subroutine null_space_init

   !> Only P and DF, for the present gradients. Where there are none, `obstacle` tells why.
   subroutine null_space_matrices(self, set, numbering)
      type(null_space_t), intent(inout) :: self
      type(constraint_set_t), intent(in) :: set
      type(numbering_t), intent(in) :: numbering

      call null_space_init(self, set, huge(self%n_entry), numbering)     ! no N to compare with
      if (self%obstacle /= obstacle_none) return
      call lay_out_matrices(self, set%force_rows)
      call fill_matrices(self, set)
   end subroutine null_space_matrices

   !> Free what the solver holds.
   subroutine null_space_free(self)
      type(null_space_t), intent(inout) :: self

      call tangent_factors_free(self%factors)
   end subroutine null_space_free

   !> Make room for another pattern.
   pure subroutine begin(self, n_unknown, n)
      type(null_space_t), intent(inout) :: self
      integer, intent(in) :: n_unknown
      integer, intent(in) :: n                           !! constraints

      self%n_free = max(0, n_unknown - n)
      if (allocated(self%present%dependent)) deallocate(self%present%dependent)
      if (allocated(self%basis%dependent)) deallocate(self%basis%dependent)
      if (allocated(self%rhs)) deallocate(self%rhs, self%x, self%part, self%image, self%owner)
      allocate(self%rhs(self%n_free), self%x(self%n_free))
      allocate(self%part(n_unknown), self%image(n_unknown))
      allocate(self%owner(n_unknown), source=0)
   end subroutine begin

   !> Choose the dependent unknowns for the present gradients and factorise Gb_d. `obstacle` tells
   !> why that is not possible.
   subroutine null_space_update(self, set, numbering)
      type(null_space_t), intent(inout) :: self
      type(constraint_set_t), intent(in) :: set
      type(numbering_t), intent(in) :: numbering
      integer :: k

      if (allocated(self%chosen_for)) deallocate(self%chosen_for)
      call independent_rows_find(self%rows, set, numbering)
      self%obstacle = obstacle_none
      if (self%rows%is_poor) self%obstacle = obstacle_pivot
      if (self%rows%n_redundant > 0) self%obstacle = obstacle_redundant
      if (self%obstacle /= obstacle_none) return
      if (.not. is_same(self%present%dependent, self%rows%dependent)) then
         call dependent_block_init(self%present, set%force_rows, self%rows%dependent)
         self%owner = 0
         self%owner(self%present%dependent) = [(k, k = 1, set%n_row)]
      end if
      ! Multipliers follow all the same.
      if (is_too_full(self)) self%obstacle = obstacle_fill
      call dependent_block_factorise(self%present, set%force_rows)
      if (self%present%bands%is_singular) self%obstacle = obstacle_pivot
   end subroutine null_space_update

   !> The same for the next iterate of a solve: a choice that was made for gradients like the
   !> present ones stays. Gb_d is that of these.
   subroutine null_space_renew(self, set, numbering)
      type(null_space_t), intent(inout) :: self  !! last updated in the same solve, or renewed
      type(constraint_set_t), intent(in) :: set  !! of the pattern it was begun with
      type(numbering_t), intent(in) :: numbering

      if (is_alike(self, set)) then
         call dependent_block_factorise(self%present, set%force_rows)
         if (.not. self%present%bands%is_singular) return
      end if
      call null_space_update(self, set, numbering)
      if (all(self%obstacle /= [obstacle_none, obstacle_fill])) return
      associate (n => set%force_rows%row_start(set%n_row + 1))
         allocate(self%chosen_for(2, n))
         self%chosen_for(1, :) = set%force_rows%value(:n)
         self%chosen_for(2, :) = set%gap_rows%value(:n)
      end associate
   end subroutine null_space_renew

   !> Are rows nearly those that the last choice was made for?
   pure logical function is_alike(self, set)
      type(null_space_t), intent(in) :: self
      type(constraint_set_t), intent(in) :: set
      integer :: k

      is_alike = allocated(self%chosen_for)
      if (is_alike) is_alike = size(self%chosen_for, 2) == set%force_rows%row_start(set%n_row + 1)
      if (.not. is_alike) return
      do k = 1, set%n_row
         associate (from => set%force_rows%row_start(k) + 1, to => set%force_rows%row_start(k + 1))
            is_alike = max(part_of(set%force_rows%value(from:to), self%chosen_for(1, from:to)), &
               part_of(set%gap_rows%value(from:to), self%chosen_for(2, from:to))) <= alike
         end associate
         if (.not. is_alike) return
      end do
   end function is_alike

   !> By which part of its largest entry a row is another one than before.
   pure real(dp) function part_of(row, before) result(part)
      real(dp), intent(in) :: row(:), before(:)

      part = 0.0_dp
      if (size(row) > 0) part = maxval(abs(row - before))
      if (part > 0.0_dp) part = part/max(maxval(abs(row)), tiny(part))
   end function part_of

   !> The two choices are made and are one.
   pure logical function is_same(a, b)
      integer, allocatable, intent(in) :: a(:), b(:)

      is_same = allocated(a) .and. allocated(b)
      if (is_same) is_same = size(a) == size(b)
      if (is_same) is_same = all(a == b)
   end function is_same

   !> Would coupled constraints give P^T N DF, and P, too many entries? Those of a constraint by
   !> itself meet in N already.
   pure logical function is_too_full(self)
      type(null_space_t), intent(in) :: self
      integer(int64) :: n_pair
      integer :: b

      n_pair = 0
      associate (block => self%present)
         do b = 1, block%bands%n_block
            associate (m => int(block%column_start(b + 1) - block%column_start(b), int64), &
                  n => int(block%bands%start(b + 1) - block%bands%start(b), int64))
               if (n > 1) n_pair = n_pair + m*(m + n)
            end associate
         end do
      end associate
      is_too_full = n_pair > int(most_fill, int64)*self%n_entry
   end function is_too_full

   !> Lay out P, DF and P^T N DF for the present choice.
   subroutine lay_out(self, rows, matrix, error)
      type(null_space_t), intent(inout) :: self
      type(csr_t), intent(in) :: rows, matrix
      type(error_t), allocatable, intent(out) :: error

      call lay_out_matrices(self, rows)
      if (self%n_free == 0) return
      call triple_product_init(self%product, self%p, matrix, self%d, self%reduced, error)
      if (allocated(error)) return
      if (.not. allocated(self%factors%general)) call tangent_factors_create(self%factors, &
         solver_default)
   end subroutine lay_out

   !> Lay out P and DF for the present choice.
   subroutine lay_out_matrices(self, rows)
      type(null_space_t), intent(inout) :: self
      type(csr_t), intent(in) :: rows

      call null_basis_pattern(self%present, self%n_free, self%p)
      self%d = self%p
      self%force = self%present
      self%gap = self%present
      call null_basis_init(self%basis, self%present, rows, self%p)
   end subroutine lay_out_matrices

   !> Fill in P and DF for the gradients of the last `null_space_update`.
   subroutine fill_matrices(self, set)
      type(null_space_t), intent(inout) :: self
      type(constraint_set_t), intent(in) :: set
      logical :: is_poor, is_poor_too

      call null_basis_fill(self%basis, self%force, set%force_rows, self%p, is_poor)
      call null_basis_fill(self%basis, self%gap, set%gap_rows, self%d, is_poor_too)
      if (is_poor .or. is_poor_too) self%obstacle = obstacle_pivot
   end subroutine fill_matrices

   !> Factorise P^T N DF for the gradients of the last `null_space_update`. Where the choice turns
   !> out as poor, `obstacle` tells.
   subroutine null_space_factorise(self, set, matrix, is_symmetric, is_singular, error)
      type(null_space_t), intent(inout) :: self
      type(constraint_set_t), intent(in) :: set
      type(csr_t), intent(in) :: matrix
      logical, intent(in) :: is_symmetric        !! P^T N DF is, up to round-off
      logical, intent(out) :: is_singular        !! there is no factor to solve with
      type(error_t), allocatable, intent(out) :: error

      is_singular = .true.
      if (self%obstacle /= obstacle_none) return
      if (.not. is_same(self%basis%dependent, self%present%dependent)) then
         call lay_out(self, set%force_rows, matrix, error)
         if (allocated(error)) return
      end if
      call stopwatch_start(self%clock)
      call fill_matrices(self, set)
      if (self%obstacle /= obstacle_none) return
      is_singular = self%n_free > 0
      if (self%n_free == 0) call stopwatch_stop(self%clock)
      if (.not. is_singular) return              ! the constraints alone tell where everything is
      call triple_product_update(self%product, self%p, matrix, self%d, self%reduced)
      call stopwatch_stop(self%clock)
      call tangent_factors_make(self%factors, self%reduced, is_symmetric, is_singular, error)
   end subroutine null_space_factorise

   !> dq = DF du - [0; G1_d^-1 defect] with P^T N dq = -P^T residual: docs/theory.md, eq. (19).
   subroutine null_space_solve(self, set, matrix, residual, dq, error)
      type(null_space_t), intent(inout) :: self
      type(constraint_set_t), intent(in) :: set
      type(csr_t), intent(in) :: matrix
      real(wp), intent(in), contiguous :: residual(:)      !! (n_unknown)
      real(wp), intent(out), contiguous :: dq(:)           !! (n_unknown)
      type(error_t), allocatable, intent(out) :: error

      call null_space_particular(self%gap, set%defect, self%part)
      dq = self%part
      if (self%n_free == 0) return
      call csr_multiply(matrix, self%part, self%image)
      self%image = -(residual + self%image)
      call csr_multiply_transposed(self%p, self%image, self%rhs)
      call tangent_factors_solve(self%factors, self%rhs, self%x, error)
      if (allocated(error)) return
      call csr_multiply(self%d, self%x, dq)
      dq = dq + self%part
   end subroutine null_space_solve

   !> -[0; G1_d^-1 defect], which closes the defect to first order.
   subroutine null_space_particular(gap, defect, part)
      type(dependent_block_t), intent(in) :: gap           !! G1_d
      real(wp), intent(in) :: defect(:)                    !! (n) [L]
      real(wp), intent(out) :: part(:)                     !! (n_unknown) [L]
      real(dp) :: x(size(defect))

      x = real(defect, dp)
      call dependent_block_solve(gap, .false., x)
      part = 0.0_wp
      part(gap%dependent) = -real(x, wp)
   end subroutine null_space_particular

   !> The multipliers from the dependent rows: Gb_d^T lam = r_d, r without contact forces;
   !> docs/theory.md, eq. (20).
   !>
   !> The factors are of kind `dp`; refinement with gradients of kind `wp` goes on as long as it
   !> gains and the equations are not yet met to the round-off of each of them.
   subroutine null_space_multipliers(self, set, numbering, residual, lam)
      type(null_space_t), intent(in) :: self
      type(constraint_set_t), intent(in) :: set
      type(numbering_t), intent(in) :: numbering
      real(wp), intent(in) :: residual(:)                  !! (n_unknown)
      real(wp), intent(out) :: lam(:)                      !! (n)
      real(wp) :: rest(set%n_row), trial(set%n_row), best, next
      real(dp) :: x(set%n_row)
      integer :: i

      rest = residual(self%present%dependent)
      trial = 0.0_wp
      best = huge(best)
      do i = 0, most_refinements
         x = real(rest, dp)
         call dependent_block_solve(self%present, .true., x)
         trial = trial + real(x, wp)
         call remainder(self, set, numbering, residual, trial, rest, next)
         if (i > 0 .and. .not. next < best) return
         best = next
         lam = trial
         if (best <= epsilon(1.0_wp)) return
      end do
   end subroutine null_space_multipliers

   !> r_d - Gb_d^T lam, and its largest entry relative to the sum of what it consists of.
   subroutine remainder(self, set, numbering, residual, lam, rest, relative)
      type(null_space_t), intent(in) :: self
      type(constraint_set_t), intent(in) :: set
      type(numbering_t), intent(in) :: numbering
      real(wp), intent(in) :: residual(:), lam(:)
      real(wp), intent(out) :: rest(:)                     !! (n)
      real(wp), intent(out) :: relative
      real(wp) :: magnitude(set%n_row)
      integer :: k

      rest = residual(self%present%dependent)
      magnitude = abs(rest)
      do k = 1, set%n_row
         associate (item => set%item(set%condition(k)))
            if (item%has_friction) then
               call subtract(item%node(:item%n_node), condition_row_force(item, set%slip(k)), &
                  lam(k))
            else
               call subtract(item%node(:item%n_node), item%g, lam(k))
            end if
         end associate
      end do
      relative = 0.0_wp
      do k = 1, set%n_row
         if (magnitude(k) > 0.0_wp) relative = max(relative, abs(rest(k))/magnitude(k))
      end do

   contains

      !> Subtract the force of a multiplier along `push`.
      subroutine subtract(node, push, factor)
         integer, intent(in) :: node(:)                    !! of the scene
         real(wp), intent(in) :: push(:, :)                !! (n_dim, >= nodes)
         real(wp), intent(in) :: factor
         real(wp) :: term
         integer :: i, a, t, l, dof

         do i = 1, size(node)
            do a = 1, size(push, 1)
               dof = size(push, 1)*(node(i) - 1) + a
               do t = numbering%start(dof) + 1, numbering%start(dof + 1)
                  if (numbering%column(t) == 0) cycle
                  l = self%owner(numbering%column(t))
                  if (l == 0) cycle
                  term = numbering%weight(t)*push(a, i)*factor
                  rest(l) = rest(l) - term
                  magnitude(l) = magnitude(l) + abs(term)
               end do
            end do
         end do
      end subroutine subtract

   end subroutine remainder

end module emcon_null_space
