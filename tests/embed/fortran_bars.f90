!> A host code in Fortran that takes contact with friction from EMCON: two plane trusses collide.
!>
!> All but contact is its own; `emcon` marks what contact needs. Bars pull with the mean of their forces at
!> both ends of a step along their direction in its middle, a discrete gradient of their energy. Energy
!> plus what friction takes is constant. Input: formulation (1 nodes, 2 segments, 3 mortar), friction.
module bars_of_a_host
   use emcon_api
   implicit none
   real(wp), parameter :: ea = 50.0_wp, h = 0.01_wp

   !> Masses are 1. To EMCON this is what solves the equations of a step.
   type, extends(host_solver_t) :: truss_t
      real(wp), allocatable :: x(:, :), u(:, :), v(:, :)   !! (2, n_node)
      integer, allocatable :: bar(:, :)                    !! (2, n_bar) nodes
   contains
      procedure :: solve                                   ! emcon
   end type truss_t

contains

   !> Add a strip of n square cells with both diagonals, lower row of nodes first.
   subroutine add_strip(self, n, low, v)
      type(truss_t), intent(inout) :: self
      integer, intent(in) :: n
      real(wp), intent(in) :: low(2), v(2)
      integer :: first, m, i

      if (.not. allocated(self%x)) allocate(self%x(2, 0), self%v(2, 0), self%bar(2, 0))
      first = size(self%x, 2)
      m = n + 1
      self%x = reshape([self%x, (low + [mod(i, m), i/m], i = 0, 2*m - 1)], [2, first + 2*m])
      self%v = reshape([self%v, (v, i = 1, 2*m)], shape(self%x))
      self%u = 0.0_wp*self%x
      self%bar = reshape([self%bar, (first + [i, i + m], i = 1, m), (first + [i, i + 1, m + i, m + i + 1, &
         i, m + i + 1, i + 1, m + i], i = 1, n)], [2, size(self%bar, 2) + m + 4*n])
   end subroutine add_strip

   !> From the first to the second node of a bar.
   pure function side(field, bar)
      real(wp), intent(in) :: field(:, :)
      integer, intent(in) :: bar(2)
      real(wp) :: side(2)

      side = field(:, bar(2)) - field(:, bar(1))
   end function side

   !> (l^2 - L^2)/(2 L^2) of a bar at displacements u.
   pure real(wp) function strain(self, u, bar)
      class(truss_t), intent(in) :: self
      real(wp), intent(in) :: u(:, :)
      integer, intent(in) :: bar(2)

      strain = dot_product(side(self%x + 0.5_wp*u, bar), side(u, bar))/sum(side(self%x, bar)**2)
   end function strain

   pure real(wp) function energy(self)
      type(truss_t), intent(in) :: self
      integer :: k

      energy = 0.5_wp*sum(self%v**2) + 0.5_wp*ea*sum([(norm2(side(self%x, self%bar(:, k))) &
         *strain(self, self%u, self%bar(:, k))**2, k = 1, size(self%bar, 2))])
   end function energy

   !> emcon: add the residual of the step by `du` without contact to the last column; subtract `second`
   !> from its tangent; solve for all columns.
   subroutine solve(self, du, second, columns, error)
      class(truss_t), intent(inout) :: self
      real(wp), intent(in), contiguous :: du(:, :)
      type(csr_t), intent(in) :: second
      real(wp), intent(inout), contiguous :: columns(:, :)
      type(error_t), allocatable, intent(out) :: error     !! none
      real(wp) :: a(size(du), size(du) + size(columns, 2)), row(size(a, 2)), length, stress, end(4), force(4)
      integer :: i, k, m, bar(2), dof(4)

      m = size(du)
      a(:, :m) = 0.0_wp
      a(:, m + 1:) = columns
      associate (r => a(:, size(a, 2)), u1 => self%u + du)
         r = r + 2.0_wp/h*reshape(du/h - self%v, [m])
         do i = 1, m
            a(i, i) = 2.0_wp/h**2
         end do
         do k = 1, size(self%bar, 2)
            bar = self%bar(:, k)
            dof = [2*bar(1) - 1, 2*bar(1), 2*bar(2) - 1, 2*bar(2)]
            length = norm2(side(self%x, bar))
            stress = 0.5_wp*ea/length*(strain(self, self%u, bar) + strain(self, u1, bar))
            end = [-side(self%x + u1, bar), side(self%x + u1, bar)]
            force = 0.5_wp*(end + [-side(self%x + self%u, bar), side(self%x + self%u, bar)])
            r(dof) = r(dof) + stress*force
            do i = 1, 4
               a(dof, dof(i)) = a(dof, dof(i)) + 0.5_wp*ea/length**3*end(i)*force
               a(dof(i), dof(i)) = a(dof(i), dof(i)) + 0.5_wp*stress
               a(dof(mod(i + 1, 4) + 1), dof(i)) = a(dof(mod(i + 1, 4) + 1), dof(i)) - 0.5_wp*stress
            end do
         end do
      end associate
      do i = 1, m                                          ! emcon
         do k = second%row_start(i) + 1, second%row_start(i + 1)
            a(i, second%column(k) + 1) = a(i, second%column(k) + 1) - real(second%value(k), wp)
         end do
      end do
      do k = 1, m                                          ! elimination
         row = a(k, :)/a(k, k)
         a = a - spread(a(:, k), 2, size(row))*spread(row, 1, m)
         a(k, :) = row
      end do
      columns = a(:, m + 1:)
   end subroutine solve
end module bars_of_a_host

program fortran_bars
   use bars_of_a_host
   implicit none
   type(truss_t) :: truss
   type(stepper_t) :: face                                 ! emcon: the interface, and what it is asked
   type(query_t) :: query
   type(interaction_t) :: interaction
   type(error_t), allocatable :: error
   integer :: formulation, master, slave, k
   integer, allocatable :: status(:)
   logical, allocatable :: active(:)
   real(wp), allocatable :: du(:, :), lam(:), slip(:, :), friction(:, :)
   real(wp) :: start, lost = 0, drift = 0

   read *, formulation, interaction%friction
   call add_strip(truss, 4, [-2.0_wp, -1.0_wp], [0.0_wp, 0.0_wp])
   call add_strip(truss, 2, [-0.875_wp, 0.125_wp], [0.25_wp, -1.0_wp])
   call stepper_new(face, truss%x, error)                  ! emcon: edges with the bodies to their left
   call stepper_add_surface(face, "lower", reshape([10, 9, 9, 8, 8, 7, 7, 6], [2, 4]), master, error)
   call stepper_add_surface(face, "upper", reshape([11, 12, 12, 13], [2, 2]), slave, error)
   call stepper_add_pair(face, slave, master, formulation, contact_options_t(), error, interaction)
   if (.not. allocated(error)) call stepper_build(face, error)
   if (allocated(error)) error stop error%message
   allocate(active(face%march%system%n_constraint), source=.false.)
   start = energy(truss)
   do k = 1, 400
      du = h*truss%v
      call query_solve_step(query, face, truss%u, du, active, lam, truss, error, stop=0.5_wp*du)     ! emcon
      if (allocated(error)) error stop error%message
      call query_slips(query, face, status, slip, friction, error)
      lost = lost + sum(slip*friction)
      truss%u = truss%u + du
      truss%v = 2.0_wp/h*du - truss%v
      drift = max(drift, abs((energy(truss) + lost)/start - 1.0_wp))
   end do
   print "(4es25.16)", drift, lost, sum(truss%v, 2)
   call query_free(query)
   call stepper_close(face)
end program fortran_bars
