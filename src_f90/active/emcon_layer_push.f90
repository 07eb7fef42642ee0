!> The forces along which the layer of massless nodes gives energy back to what has mass: those of
!> contacts that have opened or closed, condensed.
!>
!> Source: docs/theory.md, eq. (22c).
module emcon_layer_push
   use emcon_condensation, only : condensation_free, condensation_make, condensation_move, &
      condensation_t
   use emcon_constraint, only : condition_add_field, condition_row_force, condition_stiffness
   use emcon_constraint_rows, only : constraints_rows
   use emcon_constraints, only : constraint_index, constraint_set_t, constraints_evaluate, &
      constraints_force, constraints_select
   use emcon_correction, only : correction_factorise, correction_lay_out, correction_solve
   use emcon_errors, only : error_t
   use emcon_kinds, only : dp, wp
   use emcon_lapack, only : dense_solve
   use emcon_layer_type, only : layer_t
   use emcon_numbering, only : add_to_dofs, pick_unknowns
   use emcon_pushed_rows, only : pushed_rows_solve, pushed_rows_t
   use emcon_system, only : system_t, system_tangent_times
   use emcon_velocity_jumps, only : jumps_add, jumps_begin, jumps_rub
   implicit none
   private
   public :: layer_find_push

   !> What is left on z of the largest force: the energy that it would give to what has no mass goes
   !> with its square, which is round-off.
   real(wp), parameter :: uncondensed = sqrt(epsilon(1.0_wp))
   !> Rows that follow from others give way by this part of what they gain: forces have an end. What
   !> that leaves of rates is taken back so often.
   real(dp), parameter :: dependent = 1.0e4_dp*epsilon(1.0_dp)
   integer, parameter :: n_refine = 3
   !> From so many closed contacts on a solution for each takes longer than a factor for all.
   integer, parameter :: many_closed = 100

contains

   !> The forces on the massive freedoms of contacts with the multipliers `weight`, condensed: z
   !> follows them without opening the others. They have neither resultant nor moment.
   subroutine layer_find_push(self, weight, is_singular, error)
      type(layer_t), intent(inout) :: self       !! settled
      real(wp), intent(in) :: weight(:)          !! (contacts) [M L/T^2]; 0: it stays as it is
      logical, intent(out) :: is_singular        !! there are none
      type(error_t), allocatable, intent(out) :: error
      type(constraint_set_t) :: opened
      integer, allocatable :: id(:)
      real(wp), allocatable :: y(:), mu(:)
      real(wp) :: field(size(self%du, 1), size(self%du, 2))
      integer :: k

      associate (system => self%system, set => self%active%set)
         ! What has nothing in front of it any more, as an edge past the end of another, is no row.
         id = pack([(k, k = 1, size(weight))], abs(weight) > 0.0_wp .and. .not. self%acts)
         call constraints_select(opened, pack(id, have_gaps(system, id)))
         self%push = 0.0_wp
         opened%lam = weight(opened%id)
         call constraints_evaluate(opened, system, self%motion, .true.)
         call constraints_force(opened, 1, self%push)
         allocate(y(system%space%numbering%n_unknown), mu(set%n_row))
         call respond_to(self, weight, y, mu, is_singular, error)
         if (is_singular .and. .not. allocated(error)) call respond_condensed(self, weight, y, mu, &
            is_singular, error)
         if (is_singular .or. allocated(error)) return
         call add_response(self, y, mu)
         field = 0.0_wp
         call add_to_dofs(system%space%numbering, y, 1.0_wp, field)
         call jumps_begin(self%jump)
         call jumps_add(self%jump, opened, opened%lam)
         call jumps_add(self%jump, set, mu(:set%n), field)
         if (self%active%friction%is_on) call jumps_rub(self%jump, set, &
            drags(set, mu, self%active%friction%n_slip), 0.0_wp*mu(:set%n))
         self%jump%id = self%n_before + self%jump%id
         self%jump%is_condensed = .true.
         call pick_unknowns(system%space%numbering, self%push, y)
         is_singular = maxval(abs(y)) > uncondensed*maxval(abs(self%push))
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
      !> (n_unknown) [L], (n_row) [M L/T^2]; undefined where they are not found
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
         closed = pack([(k, k = 1, set%n)], abs(weight(set%id(:set%n))) > 0.0_wp)
         n = size(closed)
         if (n > many_closed) then
            call respond_at_once(self, weight, closed, y, mu, is_singular, error)
            return
         end if
         call correction_factorise(correction, system, set, is_singular, error)
         if (allocated(error) .or. is_singular) return
         allocate(residual(size(y)), ways(size(y), 0:n), forces(set%n_row, 0:n))
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

   !> The same of many contacts that have closed: their forces are a load on a factor of its own.
   subroutine respond_at_once(self, weight, closed, y, mu, is_singular, error)
      type(layer_t), intent(inout) :: self       !! with rows that are laid out
      real(wp), intent(in) :: weight(:)
      integer, intent(in) :: closed(:)           !! (any) rows of the set
      !> (n_unknown) [L], (n_row) [M L/T^2]; undefined where they are not found
      real(wp), intent(inout), contiguous :: y(:), mu(:)
      logical, intent(out) :: is_singular
      type(error_t), allocatable, intent(out) :: error
      type(pushed_rows_t) :: rows
      real(wp) :: residual(size(y))

      associate (set => self%active%set, system => self%system, &
            correction => self%newton%correction)
         is_singular = correction%n_redundant > 0
         if (is_singular) return
         rows%mu = 0.0_wp*mu
         rows%mu(closed) = weight(set%id(closed))
         rows%is_known = abs(rows%mu) > 0.0_wp
         call pick_unknowns(system%space%numbering, self%push, residual)
         call pushed_rows_solve(rows, system, set, correction, -residual, error)
         is_singular = rows%is_singular
         if (allocated(error) .or. is_singular) return
         y = rows%y
         mu = rows%mu
      end associate
   end subroutine respond_at_once

   !> The same where rows of the set follow from others, or nearly: all are condensed.
   subroutine respond_condensed(self, weight, y, mu, is_singular, error)
      type(layer_t), intent(inout) :: self
      real(wp), intent(in) :: weight(:)
      !> (n_unknown) [L], (n_row) [M L/T^2]; undefined where they are not found
      real(wp), intent(inout), contiguous :: y(:), mu(:)
      logical, intent(out) :: is_singular
      type(error_t), allocatable, intent(out) :: error
      type(condensation_t) :: condensation
      real(wp) :: residual(size(y))

      associate (set => self%active%set, system => self%system, &
            correction => self%newton%correction, first => self%active%set%n_permanent)
         call constraints_evaluate(set, system, self%motion)
         call constraints_rows(set, system%space%numbering)
         call pick_unknowns(system%space%numbering, self%push, residual)
         set%defect = 0.0_wp
         call condensation_make(condensation, system, set, correction, -residual, .true., error)
         is_singular = condensation%is_singular
         mu = 0.0_wp
         if (.not. (is_singular .or. allocated(error))) then
            mu(first + 1:set%n) = weight(set%id(first + 1:set%n))
            call hold_others(condensation, mu(first + 1:), is_singular)
            call condensation_move(condensation, correction%kept, mu(first + 1:), y, mu(:first), &
               error)
         end if
      end associate
      call condensation_free(condensation)
   end subroutine respond_condensed

   !> Multipliers of the rows that have none so far, so that their values stay as they are.
   subroutine hold_others(condensation, mu, is_singular)
      type(condensation_t), intent(in) :: condensation
      real(wp), intent(inout) :: mu(:)           !! (rows) [M L/T^2]
      logical, intent(out) :: is_singular
      real(dp), allocatable :: w(:, :), rate(:, :), held(:, :)
      integer, allocatable :: other(:)
      integer :: k

      is_singular = .false.
      other = pack([(k, k = 1, size(mu))], .not. abs(mu) > 0.0_wp)
      if (size(other) == 0) return
      w = real(condensation%w(other, other), dp)
      do k = 1, size(other)
         w(k, k) = (1.0_dp + dependent)*w(k, k)
      end do
      allocate(held(size(other), 1))
      do k = 1, n_refine
         rate = real(reshape(-condensation%free(other) - matmul(condensation%w(other, :), mu), &
            [size(other), 1]), dp)
         call dense_solve(w, rate, held, is_singular)
         if (is_singular) return
         mu(other) = mu(other) + real(held(:, 1), wp)
      end do
   end subroutine hold_others

   !> Add what the forces on all freedoms change by where z moves by `y`, and the rows of the set
   !> push with `mu` more.
   subroutine add_response(self, y, mu)
      type(layer_t), intent(inout) :: self
      real(wp), intent(in), contiguous :: y(:)   !! (n_unknown) [L]
      real(wp), intent(in) :: mu(:)              !! (n_row) [M L/T^2]
      real(wp), dimension(size(self%du, 1), size(self%du, 2)) :: displacement, product
      real(wp), allocatable :: part(:, :)
      integer :: k

      displacement = 0.0_wp
      call add_to_dofs(self%system%space%numbering, y, 1.0_wp, displacement)
      call system_tangent_times(self%system, self%motion, displacement, product)
      self%push = self%push - product
      associate (set => self%active%set, n_dim => size(displacement, 1))
         do k = 1, set%n
            associate (item => set%item(k), node => set%item(k)%node(:set%item(k)%n_node))
               part = reshape(matmul(condition_stiffness(item, set%lam(k)), &
                  reshape(displacement(:, node), [n_dim*item%n_node])), [n_dim, item%n_node])
               call condition_add_field(item, -1.0_wp, part, self%push)
            end associate
         end do
         do k = 1, set%n_row
            associate (item => set%item(set%condition(k)))
               call condition_add_field(item, mu(k), condition_row_force(item, set%slip(k)), &
                  self%push)
            end associate
         end do
      end associate
   end subroutine add_response

   !> Friction in forces `mu` of rows: of slips that stick, and by pushes where a contact slides.
   pure function drags(set, mu, n_slip) result(drag)
      type(constraint_set_t), intent(in) :: set
      real(wp), intent(in) :: mu(:)              !! (n_row) [M L/T^2]
      integer, intent(in) :: n_slip              !! slips of a contact
      real(wp) :: drag(n_slip, set%n)            !! [M L/T^2]
      integer :: k

      do k = 1, set%n
         drag(:, k) = set%item(k)%response%mu_sigma(:n_slip)*set%item(k)%normal*mu(k)
      end do
      do k = set%n + 1, set%n_row
         associate (s => set%slip(k), condition => set%condition(k))
            drag(s, condition) = drag(s, condition) + mu(k)
         end associate
      end do
   end function drags

end module emcon_layer_push
