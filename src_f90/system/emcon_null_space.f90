!> Elimination of the multipliers: null-space matrix P and reparametrisation DF of a step.
!>
!> One unknown per active constraint becomes dependent. With the constraint rows split into
!> [G_u G_d], P = [I; -Gb_d^-1 Gb_u] from the discrete gradients and DF = [I; -G1_d^-1 G1_u] from
!> the gradients at the end; P^T N DF du = -P^T r is smaller than the saddle-point system, has no
!> zero block and needs no scale. Source: docs/theory.md, section 5; paper eqs. (5) and (7).
module emcon_null_space
   use emcon_constraints, only : constraint_set_t
   use emcon_csr, only : csr_find, csr_multiply, csr_multiply_transposed, csr_t
   use emcon_errors, only : error_t
   use emcon_kinds, only : dp, wp
   use emcon_numbering, only : numbering_t
   use emcon_triple_product, only : triple_product_init, triple_product_t, triple_product_update
   use emcon_umfpack, only : umfpack_t
   implicit none
   private
   public :: null_space_t, null_space_init, null_space_factorise, null_space_solve, &
      null_space_multipliers

   !> A pivot below this fraction of its row's largest entry is poor.
   real(dp), parameter :: poor_pivot = 0.1_dp

   type :: null_space_t
      logical :: is_possible = .false.           !! each constraint has an unknown of its own
      integer :: n_free = 0                      !! independent unknowns
      integer, allocatable :: dependent(:)       !! (n) one unknown per constraint
      integer, allocatable :: place(:, :)        !! (2, n) its direction and local node
      integer, allocatable :: free(:)            !! (n_unknown) number if independent, else 0
      type(csr_t) :: p                           !! (n_unknown x n_free)
      type(csr_t) :: d                           !! (n_unknown x n_free) DF
      type(csr_t) :: reduced                     !! P^T N DF
      type(triple_product_t) :: product
      type(umfpack_t) :: solver
      real(wp), allocatable :: rhs(:), x(:)      !! (n_free)
      real(wp), allocatable :: part(:), image(:) !! (n_unknown)
   end type null_space_t

contains

   !> Choose the dependent unknowns for the active `set` and lay out P, DF and P^T N DF.
   !> `is_possible` tells whether every constraint has a good unknown that no other one holds.
   subroutine null_space_init(self, set, matrix, numbering, error)
      type(null_space_t), intent(inout) :: self
      type(constraint_set_t), intent(in) :: set
      type(csr_t), intent(in) :: matrix                  !! pattern of N
      type(numbering_t), intent(in) :: numbering
      type(error_t), allocatable, intent(out) :: error

      call choose_dependent(self, set, numbering)
      if (.not. self%is_possible) return
      call lay_out(self, set%force_rows, self%p)
      self%d = self%p
      call triple_product_init(self%product, self%p, matrix, self%d, self%reduced, error)
      if (allocated(error)) return
      call self%solver%analyse(self%reduced, error)
      if (allocated(error)) return
      if (allocated(self%rhs)) deallocate(self%rhs, self%x, self%part, self%image)
      allocate(self%rhs(self%n_free), self%x(self%n_free))
      allocate(self%part(matrix%n_row), self%image(matrix%n_row))
   end subroutine null_space_init

   !> The slave node's own unknown with the largest entry, or the largest one that no other
   !> constraint holds where that is poor.
   subroutine choose_dependent(self, set, numbering)
      type(null_space_t), intent(inout) :: self
      type(constraint_set_t), intent(in) :: set
      type(numbering_t), intent(in) :: numbering
      integer :: used(numbering%n_unknown), i, k, slave(2)
      real(dp) :: entry, best, largest

      used = 0
      associate (rows => set%force_rows)
         do i = 1, rows%row_start(set%n + 1)
            used(rows%column(i) + 1) = used(rows%column(i) + 1) + 1
         end do
         if (allocated(self%dependent)) deallocate(self%dependent, self%place)
         allocate(self%dependent(set%n), self%place(2, set%n), source=0)
         do k = 1, set%n
            slave = numbering%unknown(:, set%item(k)%node(1))
            best = 0.0_dp
            largest = 0.0_dp
            do i = rows%row_start(k) + 1, rows%row_start(k + 1)
               entry = min(abs(rows%value(i)), abs(set%gap_rows%value(i)))
               largest = max(largest, entry)
               if (used(rows%column(i) + 1) > 1) cycle
               if (all(slave /= rows%column(i) + 1)) entry = poor_pivot*entry
               if (entry <= best) cycle
               best = entry
               self%dependent(k) = rows%column(i) + 1
            end do
            self%is_possible = best > poor_pivot**2*largest
            if (.not. self%is_possible) return
            do i = 1, set%item(k)%n_node
               slave = numbering%unknown(:, set%item(k)%node(i))
               if (slave(1) == self%dependent(k)) self%place(:, k) = [1, i]
               if (slave(2) == self%dependent(k)) self%place(:, k) = [2, i]
            end do
         end do
      end associate
      self%is_possible = .true.
      if (allocated(self%free)) deallocate(self%free)
      allocate(self%free(numbering%n_unknown), source=1)
      self%free(self%dependent) = 0
      self%n_free = 0
      do i = 1, numbering%n_unknown
         if (self%free(i) == 0) cycle
         self%n_free = self%n_free + 1
         self%free(i) = self%n_free
      end do
   end subroutine choose_dependent

   !> Pattern of P: the identity, and for each dependent unknown the others of its constraint.
   subroutine lay_out(self, rows, p)
      type(null_space_t), intent(in) :: self
      type(csr_t), intent(in) :: rows
      type(csr_t), intent(out) :: p
      integer :: constraint(rows%n_col), i, k, n, pass

      constraint = 0
      do k = 1, rows%n_row
         constraint(self%dependent(k)) = k
      end do
      p%n_row = rows%n_col
      p%n_col = self%n_free
      allocate(p%row_start(p%n_row + 1), source=0)
      do pass = 1, 2
         n = 0
         do i = 1, p%n_row
            if (constraint(i) == 0) then
               n = n + 1
               if (pass == 2) p%column(n) = self%free(i) - 1
            else
               do k = rows%row_start(constraint(i)) + 1, rows%row_start(constraint(i) + 1)
                  if (rows%column(k) == i - 1) cycle
                  n = n + 1
                  if (pass == 2) p%column(n) = self%free(rows%column(k) + 1) - 1
               end do
            end if
            p%row_start(i + 1) = n
         end do
         if (pass == 1) allocate(p%column(n))
      end do
      allocate(p%value(n), source=1.0_dp)
   end subroutine lay_out

   !> Fill in the rows -G_d^-1 G_u of the dependent unknowns.
   pure subroutine fill(self, rows, p)
      type(null_space_t), intent(in) :: self
      type(csr_t), intent(in) :: rows
      type(csr_t), intent(inout) :: p
      integer :: i, k, n
      real(dp) :: pivot

      do k = 1, rows%n_row
         pivot = rows%value(csr_find(rows, k, self%dependent(k)))
         n = p%row_start(self%dependent(k))
         do i = rows%row_start(k) + 1, rows%row_start(k + 1)
            if (rows%column(i) + 1 == self%dependent(k)) cycle
            n = n + 1
            p%value(n) = -rows%value(i)/pivot
         end do
      end do
   end subroutine fill

   !> Factorise P^T N DF for the present gradients.
   subroutine null_space_factorise(self, set, matrix, is_singular, error)
      type(null_space_t), intent(inout) :: self
      type(constraint_set_t), intent(in) :: set
      type(csr_t), intent(in) :: matrix
      logical, intent(out) :: is_singular
      type(error_t), allocatable, intent(out) :: error

      call fill(self, set%force_rows, self%p)
      call fill(self, set%gap_rows, self%d)
      call triple_product_update(self%product, self%p, matrix, self%d, self%reduced)
      call self%solver%factorise(self%reduced%value, error)
      is_singular = self%solver%is_singular
   end subroutine null_space_factorise

   !> dq = DF du - [0; G1_d^-1 defect] with P^T N dq = -P^T residual.
   subroutine null_space_solve(self, set, matrix, residual, dq, error)
      type(null_space_t), intent(inout) :: self
      type(constraint_set_t), intent(in) :: set
      type(csr_t), intent(in) :: matrix
      real(wp), intent(in), contiguous :: residual(:)      !! (n_unknown)
      real(wp), intent(out), contiguous :: dq(:)           !! (n_unknown)
      type(error_t), allocatable, intent(out) :: error
      integer :: k

      self%part = 0.0_wp
      do k = 1, set%n
         self%part(self%dependent(k)) = -set%defect(k) &
            /real(set%gap_rows%value(csr_find(set%gap_rows, k, self%dependent(k))), wp)
      end do
      call csr_multiply(matrix, self%part, self%image)
      self%image = -(residual + self%image)
      call csr_multiply_transposed(self%p, self%image, self%rhs)
      call self%solver%solve(self%rhs, self%x, error)
      if (allocated(error)) return
      call csr_multiply(self%d, self%x, dq)
      dq = dq + self%part
   end subroutine null_space_solve

   !> The multipliers from the dependent rows: Gb_d^T lam = r_d, r without contact forces.
   pure subroutine null_space_multipliers(self, set, residual, lam)
      type(null_space_t), intent(in) :: self
      type(constraint_set_t), intent(in) :: set
      real(wp), intent(in) :: residual(:)                  !! (n_unknown)
      real(wp), intent(out) :: lam(:)                      !! (n)
      integer :: k

      do k = 1, set%n
         lam(k) = residual(self%dependent(k))/set%item(k)%g(self%place(1, k), self%place(2, k))
      end do
   end subroutine null_space_multipliers

end module emcon_null_space
