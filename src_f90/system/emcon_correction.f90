!> Newton corrections of the constrained system, by null space or saddle point.
!>
!> Layouts and orderings are kept as long as the active constraints stand on the same unknowns.
module emcon_correction
   use emcon_constraints, only : constraint_set_t, constraints_add_curvature, &
      constraints_merge_pattern
   use emcon_csr, only : csr_t
   use emcon_errors, only : error_t
   use emcon_kinds, only : dp, wp
   use emcon_null_space, only : null_space_factorise, null_space_init, null_space_multipliers, &
      null_space_solve, null_space_t
   use emcon_saddle_point, only : saddle_point_factorise, saddle_point_init, saddle_point_solve, &
      saddle_point_t
   use emcon_scene, only : method_null_space
   use emcon_system, only : system_t
   use emcon_umfpack, only : umfpack_t
   implicit none
   private
   public :: correction_t, correction_lay_out, correction_factorise, correction_solve, &
      correction_multipliers, correction_reset, correction_free

   type :: correction_t
      integer :: method = method_null_space      !! as the deck asks
      logical :: uses_null_space = .false.       !! for the present constraints
      logical :: fell_back = .false.             !! asked for, but no constraint has its own unknown
      integer :: n_factorisation = 0             !! made so far
      type(umfpack_t) :: solver                  !! no active constraint
      type(csr_t) :: merged                      !! N with constraints
      integer, allocatable :: slot(:)            !! entries of the system's matrix in `merged`
      integer, allocatable :: row_start(:), column(:)   !! constraint rows that the layout is for
      type(null_space_t) :: null_space
      type(saddle_point_t) :: saddle_point
   end type correction_t

contains

   !> Forget all layouts: the numbering has changed.
   subroutine correction_reset(self, method)
      type(correction_t), intent(inout) :: self
      integer, intent(in) :: method

      self%method = method
      if (allocated(self%row_start)) deallocate(self%row_start, self%column)
   end subroutine correction_reset

   !> Free what the solvers hold.
   subroutine correction_free(self)
      type(correction_t), intent(inout) :: self

      call self%solver%free()
      call self%null_space%solver%free()
      call self%saddle_point%solver%free()
   end subroutine correction_free

   !> Prepare for the pattern of the active constraints, unless it is the last one's.
   subroutine correction_lay_out(self, system, set, error)
      type(correction_t), intent(inout) :: self
      type(system_t), intent(in) :: system
      type(constraint_set_t), intent(in) :: set
      type(error_t), allocatable, intent(out) :: error
      integer :: n

      if (system%numbering%n_unknown == 0) return
      if (set%n == 0) then
         call self%solver%analyse(system%matrix, error)
         return
      end if
      n = set%force_rows%row_start(set%n + 1)
      if (allocated(self%row_start)) then
         if (size(self%row_start) == set%n + 1 .and. size(self%column) == n) then
            if (all(self%row_start == set%force_rows%row_start) .and. &
               all(self%column == set%force_rows%column(:n))) return
         end if
      end if
      self%row_start = set%force_rows%row_start
      self%column = set%force_rows%column(:n)
      call constraints_merge_pattern(set, system%matrix, self%merged, self%slot)
      self%uses_null_space = self%method == method_null_space
      if (self%uses_null_space) then
         call null_space_init(self%null_space, set, self%merged, system%numbering, error)
         if (allocated(error)) return
         self%uses_null_space = self%null_space%is_possible
      end if
      self%fell_back = self%method == method_null_space .and. .not. self%uses_null_space
      if (.not. self%uses_null_space) then
         call saddle_point_init(self%saddle_point, set, self%merged, error)
      end if
   end subroutine correction_lay_out

   !> Factorise for the present tangent, gradients and multipliers.
   subroutine correction_factorise(self, system, set, is_singular, error)
      type(correction_t), intent(inout) :: self
      type(system_t), intent(in) :: system
      type(constraint_set_t), intent(in) :: set
      logical, intent(out) :: is_singular
      type(error_t), allocatable, intent(out) :: error
      integer :: k

      self%n_factorisation = self%n_factorisation + 1
      if (set%n == 0) then
         call self%solver%factorise(system%matrix%value, error)
         is_singular = self%solver%is_singular
         return
      end if
      self%merged%value = 0.0_dp
      do k = 1, size(self%slot)
         self%merged%value(self%slot(k)) = system%matrix%value(k)
      end do
      call constraints_add_curvature(set, system%numbering, self%merged)
      if (self%uses_null_space) then
         call null_space_factorise(self%null_space, set, self%merged, is_singular, error)
      else
         call saddle_point_factorise(self%saddle_point, set, self%merged, is_singular, error)
      end if
   end subroutine correction_factorise

   !> The multipliers that belong to `residual` (without contact forces), by null space only: the
   !> saddle point has them as unknowns.
   subroutine correction_multipliers(self, set, residual)
      type(correction_t), intent(in) :: self
      type(constraint_set_t), intent(inout) :: set
      real(wp), intent(in), contiguous :: residual(:)      !! (n_unknown)

      if (set%n == 0 .or. .not. self%uses_null_space) return
      call null_space_multipliers(self%null_space, set, residual, set%lam)
   end subroutine correction_multipliers

   !> Correction `dq` of the unknowns, and for the saddle point that of the multipliers.
   subroutine correction_solve(self, set, residual, dq, dlam, error)
      type(correction_t), intent(inout) :: self
      type(constraint_set_t), intent(in) :: set
      real(wp), intent(in), contiguous :: residual(:)      !! (n_unknown) with contact forces
      real(wp), intent(out), contiguous :: dq(:)           !! (n_unknown)
      real(wp), intent(out), contiguous :: dlam(:)         !! (n)
      type(error_t), allocatable, intent(out) :: error

      dlam = 0.0_wp
      if (set%n == 0) then
         call self%solver%solve(residual, dq, error)
         dq = -dq
      else if (self%uses_null_space) then
         call null_space_solve(self%null_space, set, self%merged, residual, dq, error)
      else
         call saddle_point_solve(self%saddle_point, set, residual, dq, dlam, error)
      end if
   end subroutine correction_solve

end module emcon_correction
