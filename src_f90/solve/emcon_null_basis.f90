!> The matrix [I; -G_d^-1 G_u] of constraint rows [G_u G_d]: its columns span the motions, or weigh
!> the forces, that rows do not see. P is that of one gradient, DF of the other.
!>
!> Source: docs/theory.md, eq. (18).
module emcon_null_basis
   use emcon_band_blocks, only : band_blocks_solve
   use emcon_csr, only : csr_t
   use emcon_dependent_block, only : dependent_block_factorise, dependent_block_t
   use emcon_kinds, only : dp
   implicit none
   private
   public :: null_basis_t, null_basis_pattern, null_basis_init, null_basis_fill

   !> The choice of dependent unknowns is poor if an entry of P or DF is larger than this.
   real(dp), parameter :: most_growth = 100.0_dp

   !> How the rows of P and DF are made for one choice of dependent unknowns.
   type :: null_basis_t
      integer, allocatable :: dependent(:)       !! (n) the choice
      integer, allocatable :: n_column(:)        !! (components) independent unknowns
      integer, allocatable :: place(:)           !! (entries of the rows) in `g_u`; 0: in G_d
      integer, allocatable :: slot(:)            !! (size(g_u)) in P and DF
      real(dp), allocatable :: g_u(:)            !! Gb_u or G1_u, component by component
   end type null_basis_t

contains

   !> Pattern of P: the identity, and for each dependent unknown the independent ones of its
   !> component.
   pure subroutine null_basis_pattern(block, n_free, p)
      type(dependent_block_t), intent(in) :: block       !! the choice of dependent unknowns
      integer, intent(in) :: n_free                      !! independent unknowns
      type(csr_t), intent(out) :: p                      !! (n_unknown x n_free) values are 1
      integer, allocatable :: free(:), owner(:)
      integer :: i, k, n, n_unknown, pass

      n_unknown = n_free + size(block%dependent)
      allocate(free(n_unknown), owner(n_unknown), source=0)
      do k = 1, size(block%dependent)
         owner(block%dependent(k)) = k
      end do
      n = 0
      do i = 1, n_unknown
         if (owner(i) > 0) cycle
         n = n + 1
         free(i) = n
      end do
      p%n_row = n_unknown
      p%n_col = n_free
      allocate(p%row_start(n_unknown + 1), source=0)
      do pass = 1, 2
         n = 0
         do i = 1, n_unknown
            if (owner(i) == 0) then
               n = n + 1
               if (pass == 2) p%column(n) = free(i) - 1
            else
               associate (b => block%component(owner(i)))
                  do k = block%column_start(b) + 1, block%column_start(b + 1)
                     n = n + 1
                     if (pass == 2) p%column(n) = free(block%column(k)) - 1
                  end do
               end associate
            end if
            p%row_start(i + 1) = n
         end do
         if (pass == 1) allocate(p%column(n))
      end do
      allocate(p%value(n), source=1.0_dp)
   end subroutine null_basis_pattern

   !> Where the entries of the rows go, and where those of G_d^-1 G_u go in P.
   pure subroutine null_basis_init(self, block, rows, p)
      type(null_basis_t), intent(out) :: self
      type(dependent_block_t), intent(in) :: block
      type(csr_t), intent(in) :: rows                    !! (n x n_unknown) [G_u G_d]
      type(csr_t), intent(in) :: p                       !! of `null_basis_pattern`
      integer, allocatable :: place(:)
      integer :: b, i, j, s, before, n_row

      self%dependent = block%dependent
      self%n_column = block%column_start(2:) - block%column_start(:block%bands%n_block)
      associate (start => block%bands%start, column => block%column)
         allocate(self%place(size(block%slot)), place(rows%n_col), source=0)
         allocate(self%slot(sum(self%n_column*(start(2:) - start(:block%bands%n_block)))))
         before = 0
         do b = 1, block%bands%n_block
            n_row = start(b + 1) - start(b)
            do j = 1, self%n_column(b)
               place(column(block%column_start(b) + j)) = before + n_row*(j - 1)
            end do
            do i = 1, n_row
               associate (k => block%order(start(b) + i))
                  do s = rows%row_start(k) + 1, rows%row_start(k + 1)
                     if (block%slot(s) == 0) self%place(s) = place(rows%column(s) + 1) + i
                  end do
                  do j = 1, self%n_column(b)
                     self%slot(before + n_row*(j - 1) + i) = p%row_start(block%dependent(k)) + j
                  end do
               end associate
            end do
            before = before + n_row*self%n_column(b)
         end do
      end associate
      allocate(self%g_u(size(self%slot)), source=0.0_dp)
   end subroutine null_basis_init

   !> Fill in the rows -G_d^-1 G_u of the dependent unknowns; poor ones are not filled in.
   subroutine null_basis_fill(self, block, rows, p, is_poor)
      type(null_basis_t), intent(inout) :: self
      type(dependent_block_t), intent(inout) :: block    !! G_d, factorised here
      type(csr_t), intent(in) :: rows                    !! (n x n_unknown) [G_u G_d]
      type(csr_t), intent(inout) :: p                    !! of `null_basis_pattern`
      logical, intent(out) :: is_poor                    !! the choice does not do for `rows`
      integer :: i

      call dependent_block_factorise(block, rows)
      is_poor = block%bands%is_singular
      if (is_poor) return
      self%g_u = 0.0_dp
      do i = 1, size(self%place)
         if (self%place(i) > 0) self%g_u(self%place(i)) = rows%value(i)
      end do
      call band_blocks_solve(block%bands, .false., self%n_column, self%g_u)
      is_poor = .not. all(abs(self%g_u) <= most_growth)
      if (is_poor) return
      do i = 1, size(self%slot)
         p%value(self%slot(i)) = -self%g_u(i)
      end do
   end subroutine null_basis_fill

end module emcon_null_basis
