!> The mass that impulses move: factorised over the unknowns, with what of a jump of velocities is
!> forbidden by conditions that always hold.
!>
!> Source: docs/theory.md, section 6.
module emcon_velocity_mass
   use emcon_constraint, only : condition_add_field, condition_row_gradient
   use emcon_constraints, only : constraint_set_t
   use emcon_csr, only : csr_find, csr_t
   use emcon_errors, only : error_t
   use emcon_kinds, only : dp, wp
   use emcon_lapack, only : dense_solve
   use emcon_numbering, only : add_to_dofs, numbering_matrix, pick_unknowns
   use emcon_solver_registry, only : solver_create, solver_default
   use emcon_sparse_solver, only : matrix_definite, sparse_solver_t
   use emcon_system, only : system_t
   use emcon_term_registry, only : terms_mass_values
   use emcon_triple_product, only : triple_product_init, triple_product_t, triple_product_update
   implicit none
   private
   public :: velocity_update_t, velocity_update_reset, velocity_update_free
   public :: impulse_row_t, velocity_mass_prepare, velocity_mass_respond, velocity_mass_keep, &
      velocity_mass_pick, velocity_mass_move

   !> What an impulse acts along.
   type :: impulse_row_t
      integer :: condition                       !! of the set
      integer :: slip = 0                        !! of it; 0: the gap
   end type impulse_row_t

   type :: velocity_update_t
      logical :: is_ready = .false.              !! mass factorised for the present numbering
      integer :: choice = solver_default         !! of the direct solver, as the deck asks
      class(sparse_solver_t), allocatable :: user    !! by a program, for that choice
      class(sparse_solver_t), allocatable :: mass
      real(wp), allocatable :: push(:), jump(:)  !! (n_unknown)
      real(wp) :: part = 0.0_wp                  !! of the jump that was taken last [T]
   end type velocity_update_t

contains

   !> The numbering has changed.
   subroutine velocity_update_reset(self, choice, user)
      type(velocity_update_t), intent(inout) :: self
      integer, intent(in) :: choice              !! one of `solver_`, or above
      class(sparse_solver_t), intent(in), optional :: user     !! as in `solver_create`

      self%choice = choice
      if (allocated(self%user)) deallocate(self%user)
      if (present(user)) allocate(self%user, source=user)
      self%is_ready = .false.
   end subroutine velocity_update_reset

   subroutine velocity_update_free(self)
      type(velocity_update_t), intent(inout) :: self

      if (allocated(self%mass)) call self%mass%free()
      self%is_ready = .false.
   end subroutine velocity_update_free

   !> Factorise the mass, if the numbering is another one than before.
   subroutine velocity_mass_prepare(self, system, is_singular, error)
      type(velocity_update_t), intent(inout) :: self
      type(system_t), intent(in) :: system
      logical, intent(out) :: is_singular        !! it has no inverse: nothing is to be done
      type(error_t), allocatable, intent(out) :: error

      if (.not. self%is_ready) call factorise_mass(self, system, error)
      is_singular = .false.
      if (.not. allocated(error)) is_singular = self%mass%is_singular
   end subroutine velocity_mass_prepare

   !> Factorise the mass over the unknowns, T^T M T over those that linear constraints leave.
   subroutine factorise_mass(self, system, error)
      type(velocity_update_t), intent(inout) :: self
      type(system_t), intent(in) :: system
      type(error_t), allocatable, intent(out) :: error
      type(triple_product_t) :: product
      type(csr_t) :: mass, links, reduced
      real(dp), allocatable :: value(:)
      integer :: n

      call solver_create(self%choice, matrix_definite, self%mass, self%user)
      self%mass%accuracy = epsilon(1.0_dp)       ! nothing corrects a jump afterwards
      self%mass%is_even = .true.
      n = system%space%numbering%n_unknown
      call terms_mass_values(system%term, value)
      call fill_massless(system%matrix, value)
      if (keeps_links(system)) then
         n = system%space%linked%n_unknown
         mass = system%matrix
         mass%value = value
         call numbering_matrix(system%space%linked, system%space%numbering%dof, links)
         call triple_product_init(product, links, mass, links, reduced, error)
         if (allocated(error)) return
         call triple_product_update(product, links, mass, links, reduced)
         call self%mass%analyse(reduced, error)
         if (.not. allocated(error)) call self%mass%factorise(reduced%value, error)
      else
         call self%mass%analyse(system%matrix, error)
         if (.not. allocated(error)) call self%mass%factorise(value, error)
      end if
      if (allocated(self%push)) deallocate(self%push, self%jump)
      allocate(self%push(n), self%jump(n))
      self%is_ready = .not. allocated(error)
   end subroutine factorise_mass

   !> What has no mass gets the largest one: it stands alone, and nothing pushes it.
   pure subroutine fill_massless(matrix, value)
      type(csr_t), intent(in) :: matrix          !! its pattern
      real(dp), intent(inout) :: value(:)
      real(dp) :: largest
      integer :: i, k

      largest = maxval(value)
      do i = 1, matrix%n_row
         k = csr_find(matrix, i, i)
         if (k > 0) then
            if (.not. value(k) > 0.0_dp) value(k) = largest
         end if
      end do
   end subroutine fill_massless

   !> Gradients of gaps and slips of conditions at the end of the step, and what impulses of 1 along
   !> them move. Without friction those of slips are 0.
   subroutine velocity_mass_respond(self, system, set, which, row, response, error)
      type(velocity_update_t), intent(inout) :: self
      type(system_t), intent(in) :: system
      type(constraint_set_t), intent(in) :: set
      type(impulse_row_t), intent(in) :: which(:)        !! (n)
      real(wp), allocatable, intent(out) :: row(:, :), response(:, :) !! (n_unknown, n) C, M^-1 C^T
      type(error_t), allocatable, intent(out) :: error
      real(wp) :: field(size(system%space%is_alive, 1), size(system%space%is_alive, 2))
      integer :: k

      allocate(row(size(self%jump), size(which)), response(size(self%jump), size(which)), &
         source=0.0_wp)
      do k = 1, size(which)
         associate (item => set%item(which(k)%condition), slip => which(k)%slip)
            if (slip > 0 .and. .not. item%has_friction) cycle
            field = 0.0_wp
            call condition_add_field(item, 1.0_wp, condition_row_gradient(item, slip), field)
         end associate
         call velocity_mass_pick(system, field, row(:, k))
         call self%mass%solve(row(:, k), response(:, k), error)
         if (allocated(error)) return
      end do
   end subroutine velocity_mass_respond

   !> Take out of jumps what conditions that always hold, and are not linear, forbid: add
   !> M^-1 C^T mu such that C times a jump is 0, or `wanted`, with their gradients C at the end of
   !> the step.
   subroutine velocity_mass_keep(self, system, set, error, jump, is_singular, wanted)
      type(velocity_update_t), intent(inout) :: self
      type(system_t), intent(in) :: system
      type(constraint_set_t), intent(in) :: set
      type(error_t), allocatable, intent(out) :: error
      real(wp), intent(inout) :: jump(:, :)          !! (n_unknown, any)
      logical, intent(out) :: is_singular            !! the jumps are as they were
      real(wp), intent(in), optional :: wanted(:)    !! (conditions that are not linear)
      real(wp), allocatable :: row(:, :), response(:, :)
      real(dp), dimension(set%n_permanent - set%n_linear, size(jump, 2)) :: rate, mu
      real(dp) :: product(size(rate, 1), size(rate, 1))
      integer :: k

      is_singular = .false.
      if (size(rate) == 0) return
      call velocity_mass_respond(self, system, set, [(impulse_row_t(k), k = set%n_linear + 1, &
         set%n_permanent)], row, response, error)
      if (allocated(error)) return
      rate = -real(matmul(transpose(row), jump), dp)
      if (present(wanted)) rate = rate + spread(real(wanted, dp), 2, size(jump, 2))
      product = real(matmul(transpose(row), response), dp)
      call dense_solve(product, rate, mu, is_singular)
      if (.not. is_singular) jump = jump + matmul(response, real(mu, wp))
   end subroutine velocity_mass_keep

   !> The entries of `field` at the unknowns that linear constraints leave.
   pure subroutine velocity_mass_pick(system, field, vector)
      type(system_t), intent(in) :: system
      real(wp), intent(in), contiguous :: field(:, :)    !! (n_dim, n_node)
      real(wp), intent(out) :: vector(:)                 !! (n_unknown)

      if (keeps_links(system)) then
         call pick_unknowns(system%space%linked, field, vector)
      else
         call pick_unknowns(system%space%numbering, field, vector)
      end if
   end subroutine velocity_mass_pick

   !> Add `part` of the jump to `v`.
   subroutine velocity_mass_move(self, system, part, v)
      type(velocity_update_t), intent(inout) :: self
      type(system_t), intent(in) :: system
      real(wp), intent(in) :: part               !! [T], or 1 of a jump
      real(wp), intent(inout), contiguous :: v(:, :)     !! (n_dim, n_node) [L/T]

      self%part = part
      if (keeps_links(system)) then
         call add_to_dofs(system%space%linked, self%jump, part, v)
      else
         call add_to_dofs(system%space%numbering, self%jump, part, v)
      end if
   end subroutine velocity_mass_move

   !> Are linear constraints not eliminated in the numbering? A jump has to keep them all the same.
   pure logical function keeps_links(system)
      type(system_t), intent(in) :: system

      keeps_links = system%space%linear%n > 0 .and. .not. system%space%is_reduced
   end function keeps_links

end module emcon_velocity_mass
