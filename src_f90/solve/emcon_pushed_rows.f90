!> A step linearised where it is, of which some rows push with known multipliers and others hold.
!>
!> With the tangent N, the directions F of forces and the gradients G of the values of rows,
!> N y = F^T mu - r, and G y = 0 for the rows that hold. What is known of mu is a load: that is one
!> solution, of however many rows. Source: docs/theory.md, eq. (22c).
module emcon_pushed_rows
   use emcon_constraint_rows, only : constraints_add_curvature, constraints_merge_pattern
   use emcon_constraints, only : constraint_set_t
   use emcon_correction, only : correction_t
   use emcon_csr, only : csr_pick_rows, csr_t
   use emcon_errors, only : error_t
   use emcon_kinds, only : wp
   use emcon_saddle_point, only : saddle_point_factorise, saddle_point_free, saddle_point_init, &
      saddle_point_reset, saddle_point_solve, saddle_point_t
   use emcon_system, only : system_t
   implicit none
   private
   public :: pushed_rows_t, pushed_rows_solve

   type :: pushed_rows_t
      logical, allocatable :: is_known(:)        !! (n_row) `mu` is given, the row does not hold
      real(wp), allocatable :: mu(:)             !! (n_row) multipliers, then of all [M L/T^2]
      real(wp), allocatable :: y(:)              !! (n_unknown) the motion [L]
      logical :: is_singular = .true.            !! there is none
   end type pushed_rows_t

contains

   !> The motion, and the multipliers of the rows that hold.
   subroutine pushed_rows_solve(self, system, set, correction, residual, error)
      type(pushed_rows_t), intent(inout) :: self         !! with what is known
      type(system_t), intent(in) :: system               !! with the tangent of its terms
      type(constraint_set_t), intent(in) :: set          !! evaluated, with rows
      type(correction_t), intent(in) :: correction       !! by the solvers of which
      real(wp), intent(in), contiguous :: residual(:)    !! (n_unknown) without forces of rows
      type(error_t), allocatable, intent(out) :: error
      type(saddle_point_t) :: saddle_point

      call saddle_point_reset(saddle_point, correction%choice, correction%user)
      call solve(self, saddle_point, system, set, residual, error)
      call saddle_point_free(saddle_point)
   end subroutine pushed_rows_solve

   !> By the saddle point of the rows that hold.
   subroutine solve(self, saddle_point, system, set, residual, error)
      type(pushed_rows_t), intent(inout) :: self
      type(saddle_point_t), intent(inout) :: saddle_point
      type(system_t), intent(in) :: system
      type(constraint_set_t), intent(in) :: set
      real(wp), intent(in), contiguous :: residual(:)    !! (n_unknown)
      type(error_t), allocatable, intent(out) :: error
      type(constraint_set_t) :: held
      type(csr_t) :: tangent
      real(wp), allocatable :: mu(:)
      integer, allocatable :: row(:), slot(:)
      integer :: k

      row = pack([(k, k = 1, set%n_row)], .not. self%is_known)
      held%n_row = size(row)
      call csr_pick_rows(set%force_rows, row, held%force_rows)
      call csr_pick_rows(set%gap_rows, row, held%gap_rows)
      allocate(held%defect(size(row)), mu(size(row)), source=0.0_wp)
      call constraints_merge_pattern(set, system%matrix, tangent, slot)
      do k = 1, size(slot)
         tangent%value(slot(k)) = system%matrix%value(k)
      end do
      call constraints_add_curvature(set, system%space%numbering, tangent)
      call saddle_point_init(saddle_point, held, tangent, error)
      if (.not. allocated(error)) call saddle_point_factorise(saddle_point, held, tangent, &
         self%is_singular, error)
      if (allocated(error) .or. self%is_singular) return
      if (allocated(self%y)) deallocate(self%y)
      allocate(self%y(size(residual)))
      call saddle_point_solve(saddle_point, held, pushed(self, set, residual), self%y, mu, error)
      self%mu(row) = mu
   end subroutine solve

   !> The residual with the forces of the rows whose multipliers are known.
   pure function pushed(self, set, residual) result(left)
      type(pushed_rows_t), intent(in) :: self
      type(constraint_set_t), intent(in) :: set
      real(wp), intent(in) :: residual(:)        !! (n_unknown)
      real(wp) :: left(size(residual))
      integer :: k, i

      left = residual
      do k = 1, set%n_row
         if (.not. self%is_known(k)) cycle
         do i = set%force_rows%row_start(k) + 1, set%force_rows%row_start(k + 1)
            associate (unknown => set%force_rows%column(i) + 1)
               left(unknown) = left(unknown) - self%mu(k)*real(set%force_rows%value(i), wp)
            end associate
         end do
      end do
   end function pushed

end module emcon_pushed_rows
