!> Null space and reparametrisation of the selected constraints of an interface, over the unknowns
!> that its ties leave. Source: docs/theory.md, section 5.
module emcon_interface_null_space
   use emcon_constraints, only : constraints_rows
   use emcon_csr, only : csr_t
   use emcon_errors, only : err_analysis, error_t, raise
   use emcon_interface, only : interface_t
   use emcon_interface_check, only : check_list, refuse
   use emcon_interface_stage, only : check_begun, check_evaluated
   use emcon_kinds, only : wp
   use emcon_null_space, only : null_space_matrices, null_space_multipliers, &
      null_space_particular, obstacle_none, obstacle_redundant
   use emcon_text, only : to_text
   implicit none
   private
   public :: interface_null_space, interface_multipliers, interface_particular

contains

   !> P and DF over the unknowns of `interface_links`, for the constraints as last evaluated:
   !> P^T T^T G^T = 0 for the discrete gradients G, and C T DF = 0 for the gradients at the end.
   !>
   !> `redundant`: places of selected constraints that follow from others, for `interface_drop`;
   !> then there are no matrices. Error: there is no good choice of unknowns to eliminate, use the
   !> multipliers.
   subroutine interface_null_space(self, p, df, redundant, error)
      type(interface_t), intent(inout) :: self
      type(csr_t), intent(out) :: p, df          !! (n_unknown x n_unknown - n)
      integer, allocatable, intent(out) :: redundant(:)
      type(error_t), allocatable, intent(out) :: error
      character(len=*), parameter :: place = "interface_null_space"

      allocate(redundant(0))
      call check_begun(self, place, error)
      if (.not. allocated(error)) call check_evaluated(self, place, error)
      if (allocated(error)) return
      associate (set => self%active%set, space => self%space)
         call constraints_rows(set, self%linked)
         call null_space_matrices(space, set, self%linked)
         if (space%obstacle == obstacle_redundant) then
            redundant = space%rows%redundant(:space%rows%n_redundant)
         else if (space%obstacle /= obstacle_none) then
            call raise(error, err_analysis, place // ": no good choice of " // to_text(set%n) // &
               " unknowns to eliminate; solve with the multipliers")
         end if
         if (space%obstacle /= obstacle_none) return
         p = space%p
         df = space%d
      end associate
   end subroutine interface_null_space

   !> lam from the dependent rows of the residual without contact forces, after
   !> `interface_null_space`: T^T r = sum lam_k T^T g_k.
   subroutine interface_multipliers(self, residual, lam, error)
      type(interface_t), intent(in) :: self
      real(wp), intent(in) :: residual(:)        !! (n_unknown) T^T r [M L/T^2]
      real(wp), intent(out) :: lam(:)            !! (n)
      type(error_t), allocatable, intent(out) :: error
      character(len=*), parameter :: place = "interface_multipliers"

      lam = 0.0_wp
      call check_space(self, place, error)
      call check_list(error, place, "residual", residual, self%n_unknown)
      call check_list(error, place, "lam", lam, self%active%set%n)
      if (.not. allocated(error)) call null_space_multipliers(self%space, self%active%set, &
         self%linked, residual, lam)
   end subroutine interface_multipliers

   !> The motion of dependent unknowns alone that closes `defect` to first order, after
   !> `interface_null_space`; Newton's step is this plus DF times that of the others.
   subroutine interface_particular(self, defect, dw, error)
      type(interface_t), intent(in) :: self
      real(wp), intent(in) :: defect(:)          !! (n) [L]
      real(wp), intent(out) :: dw(:)             !! (n_unknown) [L]
      type(error_t), allocatable, intent(out) :: error
      character(len=*), parameter :: place = "interface_particular"

      dw = 0.0_wp
      call check_space(self, place, error)
      call check_list(error, place, "defect", defect, self%active%set%n)
      call check_list(error, place, "dw", dw, self%n_unknown)
      if (.not. allocated(error)) call null_space_particular(self%space%gap, defect, dw)
   end subroutine interface_particular

   !> The null space is that of the selected constraints.
   pure subroutine check_space(self, place, error)
      type(interface_t), intent(in) :: self
      character(len=*), intent(in) :: place
      type(error_t), allocatable, intent(out) :: error

      if (.not. allocated(self%space%gap%dependent)) then
         call refuse(error, place, "called before interface_null_space")
      else if (size(self%space%gap%dependent) /= self%active%set%n) then
         call refuse(error, place, "the constraints have changed since interface_null_space")
      else
         call check_evaluated(self, place, error)
      end if
   end subroutine check_space

end module emcon_interface_null_space
