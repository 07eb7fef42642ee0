!> What moves under forces in a step that is linearised where it is, without its contacts.
!>
!> The matrix of the step is factorised as it stands; the conditions that always hold prevent what
!> they prevent.
module emcon_flexibility
   use emcon_constraint, only : condition_t
   use emcon_constraints, only : constraint_set_t
   use emcon_correction, only : correction_t
   use emcon_errors, only : error_t
   use emcon_kinds, only : dp, wp
   use emcon_lapack, only : dense_solve
   use emcon_numbering, only : numbering_t
   use emcon_solver_registry, only : solver_create
   use emcon_sparse_solver, only : matrix_general, sparse_solver_t
   use emcon_system, only : system_t
   implicit none
   private
   public :: flexibility_t, flexibility_make, flexibility_move, flexibility_row, flexibility_free

   type :: flexibility_t
      logical :: is_singular = .true.            !! something moves freely: nothing is known
      class(sparse_solver_t), allocatable, private :: solver
      !> Motions by the forces of what always holds (n_unknown, n_held), and its rows, the other way
      real(wp), allocatable, private :: held(:, :), rate(:, :)
   end type flexibility_t

contains

   !> Factorise the matrix of the system.
   subroutine flexibility_make(self, system, set, correction, error)
      type(flexibility_t), intent(out) :: self
      type(system_t), intent(in) :: system       !! with the matrix of the step
      type(constraint_set_t), intent(in) :: set  !! whose first conditions always hold
      type(correction_t), intent(in) :: correction   !! by the solver of which
      type(error_t), allocatable, intent(out) :: error
      integer :: k

      call solver_create(correction%choice, matrix_general, self%solver, correction%user)
      call self%solver%analyse(system%matrix, error)
      if (.not. allocated(error)) call self%solver%factorise(system%matrix%value, error)
      if (allocated(error)) return
      self%is_singular = self%solver%is_singular
      if (self%is_singular) return
      associate (numbering => system%space%numbering)
         allocate(self%held(numbering%n_unknown, set%n_permanent), source=0.0_wp)
         allocate(self%rate(set%n_permanent, numbering%n_unknown))
         do k = 1, set%n_permanent
            self%rate(k, :) = flexibility_row(numbering, set%item(k), set%item(k)%c)
            call self%solver%solve(flexibility_row(numbering, set%item(k), set%item(k)%g), &
               self%held(:, k), error)
            if (allocated(error)) return
         end do
      end associate
   end subroutine flexibility_make

   !> The motion under a force, with what always holds.
   subroutine flexibility_move(self, force, displacement, error)
      type(flexibility_t), intent(inout) :: self     !! not singular
      real(wp), intent(in) :: force(:)           !! (n_unknown) [M L/T^2]
      real(wp), intent(out) :: displacement(:)   !! (n_unknown) [L]
      type(error_t), allocatable, intent(out) :: error
      real(dp) :: matrix(size(self%rate, 1), size(self%rate, 1))
      real(dp), dimension(size(self%rate, 1), 1) :: rate, lam
      logical :: is_singular

      call self%solver%solve(force, displacement, error)
      if (allocated(error) .or. size(self%rate, 1) == 0) return
      matrix = real(matmul(self%rate, self%held), dp)
      rate(:, 1) = real(matmul(self%rate, displacement), dp)
      call dense_solve(matrix, rate, lam, is_singular)
      displacement = displacement - matmul(self%held, real(lam(:, 1), wp))
   end subroutine flexibility_move

   !> Derivatives by the nodes of a condition as those by the unknowns.
   pure function flexibility_row(numbering, item, part) result(row)
      type(numbering_t), intent(in) :: numbering
      type(condition_t), intent(in) :: item
      real(wp), intent(in) :: part(:, :)         !! (n_dim, >= n_node)
      real(wp) :: row(numbering%n_unknown)
      integer :: i, a, t

      row = 0.0_wp
      do i = 1, item%n_node
         do a = 1, size(part, 1)
            associate (dof => size(part, 1)*(item%node(i) - 1) + a)
               do t = numbering%start(dof) + 1, numbering%start(dof + 1)
                  associate (column => numbering%column(t))
                     if (column > 0) row(column) = row(column) + numbering%weight(t)*part(a, i)
                  end associate
               end do
            end associate
         end do
      end do
   end function flexibility_row

   subroutine flexibility_free(self)
      type(flexibility_t), intent(inout) :: self

      if (allocated(self%solver)) call self%solver%free()
   end subroutine flexibility_free

end module emcon_flexibility
