!> The forces along which the layer of massless nodes gives energy back to what has mass: those of
!> contacts that have opened or closed, condensed.
!>
!> Source: docs/theory.md, eq. (22c).
module emcon_layer_push
   use emcon_constraint, only : condition_add_field
   use emcon_constraint_rows, only : constraints_rows
   use emcon_constraints, only : constraint_index, constraint_set_t, constraints_evaluate, &
      constraints_force, constraints_select
   use emcon_correction, only : correction_factorise, correction_lay_out, correction_solve
   use emcon_curvature, only : curvature_add_times
   use emcon_errors, only : error_t
   use emcon_kinds, only : dp, wp
   use emcon_lapack, only : dense_solve
   use emcon_layer_type, only : layer_t
   use emcon_numbering, only : add_to_dofs, pick_unknowns
   use emcon_system, only : system_t, system_tangent_times
   use emcon_velocity_jumps, only : jumps_add, jumps_begin
   implicit none
   private
   public :: layer_find_push

contains

   !> The forces on the massive freedoms of contacts with the multipliers `weight`, condensed: z
   !> follows them without opening the others. They have neither resultant nor moment.
   subroutine layer_find_push(self, weight, is_singular, error)
      type(layer_t), intent(inout) :: self       !! settled
      real(wp), intent(in) :: weight(:)          !! (contacts) [M L/T^2]; 0: it stays as it is
      logical, intent(out) :: is_singular        !! there are none
      type(error_t), allocatable, intent(out) :: error
      type(constraint_set_t) :: opened
      real(wp), allocatable :: y(:), mu(:)
      real(wp) :: field(size(self%du, 1), size(self%du, 2))
      integer :: k

      associate (system => self%system, set => self%active%set)
         call constraints_select(opened, pack([(k, k = 1, size(weight))], &
            abs(weight) > 0.0_wp .and. .not. self%acts))
         ! After a step that is far too large a contact may have nothing in front of it any more.
         is_singular = .not. all(have_gaps(system, opened%id))
         self%push = 0.0_wp
         if (is_singular) return
         opened%lam = weight(opened%id)
         call constraints_evaluate(opened, system, self%motion)
         call constraints_force(opened, 1, self%push)
         allocate(y(system%space%numbering%n_unknown), mu(set%n))
         call respond_to(self, weight, y, mu, is_singular, error)
         if (is_singular .or. allocated(error)) return
         field = 0.0_wp
         call add_to_dofs(system%space%numbering, y, 1.0_wp, field)
         call jumps_begin(self%jump)
         call jumps_add(self%jump, opened, opened%lam)
         call jumps_add(self%jump, set, mu, field)
         self%jump%id = self%n_before + self%jump%id
         call add_tangent(self, field)
         do k = 1, set%n
            call condition_add_field(set%item(k), mu(k), set%item(k)%c, self%push)
         end do
      end associate
   end subroutine layer_find_push

   !> Has each of these contacts an edge in front of it, as gaps were last measured?
   pure function have_gaps(system, id)
      type(system_t), intent(in) :: system
      integer, intent(in) :: id(:)               !! (n) contacts
      logical :: have_gaps(size(id))
      integer :: k, pair, i

      do k = 1, size(id)
         call constraint_index(system, id(k), pair, i)
         have_gaps(k) = system%contact(pair)%contact%state(i)%is_near
      end do
   end function have_gaps

   !> How z moves, and which multipliers of the set that takes: those of contacts that have closed
   !> are `weight`, the others close no gap and open none.
   subroutine respond_to(self, weight, y, mu, is_singular, error)
      type(layer_t), intent(inout) :: self
      real(wp), intent(in) :: weight(:)
      !> (n_unknown) [L], (n) [M L/T^2]; undefined where they are not found
      real(wp), intent(inout), contiguous :: y(:), mu(:)
      logical, intent(out) :: is_singular
      type(error_t), allocatable, intent(out) :: error
      integer, allocatable :: closed(:)
      real(wp), allocatable :: ways(:, :), forces(:, :), residual(:)
      real(dp), allocatable :: opening(:, :)     !! of the contacts that have closed
      integer :: i, k, n

      is_singular = .false.
      associate (set => self%active%set, system => self%system, &
            correction => self%newton%correction)
         call constraints_evaluate(set, system, self%motion)
         call constraints_rows(set, system%space%numbering)
         call correction_lay_out(correction, system, set)
         call correction_factorise(correction, system, set, is_singular, error)
         if (allocated(error) .or. is_singular) return
         closed = pack([(k, k = 1, set%n)], abs(weight(set%id(:set%n))) > 0.0_wp)
         n = size(closed)
         allocate(residual(size(y)), ways(size(y), 0:n), forces(set%n, 0:n))
         call pick_unknowns(system%space%numbering, self%push, residual)
         residual = -residual
         set%defect = 0.0_wp
         call correction_solve(correction, set, residual, ways(:, 0), forces(:, 0), error)
         residual = 0.0_wp
         do i = 1, n
            if (allocated(error)) return
            set%defect = 0.0_wp
            set%defect(closed(i)) = -1.0_wp
            call correction_solve(correction, set, residual, ways(:, i), forces(:, i), error)
         end do
         if (allocated(error)) return
         allocate(opening(n, 1))
         call dense_solve(real(forces(closed, 1:), dp), real(reshape( &
            weight(set%id(closed)) - forces(closed, 0), [n, 1]), dp), opening, is_singular)
         y = ways(:, 0) + matmul(ways(:, 1:), real(opening(:, 1), wp))
         mu = forces(:, 0) + matmul(forces(:, 1:), real(opening(:, 1), wp))
      end associate
   end subroutine respond_to

   !> Subtract what the forces on all freedoms change by where z moves by `way`.
   subroutine add_tangent(self, displacement)
      type(layer_t), intent(inout) :: self
      real(wp), intent(in), contiguous :: displacement(:, :)
      real(wp) :: product(size(displacement, 1), size(displacement, 2))

      call system_tangent_times(self%system, self%motion, displacement, product)
      self%push = self%push - product
      call curvature_add_times(self%active%set, self%active%set%lam, displacement, self%push)
   end subroutine add_tangent

end module emcon_layer_push
