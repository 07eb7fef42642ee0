!> Point masses and bars for tests of hosts, with a dense Newton step in the null space of contact.
!>
!> The strain of a bar, (l^2 - L^2)/(2 L^2), is quadratic in the positions, so the mean of its
!> values at both ends of a step, with the direction at the middle, is a discrete gradient of
!> EA L strain^2/2: all that the host has to do for its part of the energy.
module truss_host
   use emcon_csr, only : csr_t
   use emcon_errors, only : err_analysis, error_t, raise
   use emcon_kinds, only : dp, wp
   use emcon_lapack, only : dense_solve
   use emcon_stepper, only : stepper_build, stepper_t
   use emcon_stepper_contact, only : query_begin_contact, query_contact, query_drop, &
      query_select, query_update_active, step_done
   use emcon_stepper_host, only : stepper_hold, stepper_new
   use emcon_stepper_null_space, only : query_multipliers, query_null_space, query_particular
   use emcon_stepper_query, only : query_t
   use emcon_stepper_report, only : contact_report_t, query_curvature
   use emcon_text, only : to_text
   use sparse_samples, only : dense_of
   implicit none
   private
   public :: face_t, face_new, face_build, face_n
   public :: truss_t, truss_begin, truss_add, truss_respond, truss_step
   public :: truss_energy, truss_momentum

   !> A model of the host's nodes, and what it is asked.
   type :: face_t
      type(stepper_t) :: stepper
      type(query_t) :: query
   end type face_t

   type :: truss_t
      real(wp), allocatable :: x(:, :), u(:, :), v(:, :)   !! (2, n_node)
      real(wp), allocatable :: mass(:)                     !! (n_node)
      integer, allocatable :: bar(:, :)                    !! (2, n_bar)
      real(wp) :: stiffness = 1.0_wp                       !! EA
      logical, allocatable :: is_active(:)                 !! (n_constraint)
      integer :: n_contact = 0                             !! active ones of the last step
   end type truss_t

   integer, parameter :: most_iterations = 25, most_sets = 100

contains

   subroutine face_new(face, x, error)
      type(face_t), intent(out) :: face
      real(wp), intent(in) :: x(:, :)
      type(error_t), allocatable, intent(out) :: error

      call stepper_new(face%stepper, x, error)
   end subroutine face_new

   !> Finish a model whose freedoms `held` the host moves by itself.
   subroutine face_build(face, held, error)
      type(face_t), intent(inout) :: face
      logical, intent(in) :: held(:, :)                    !! (2, n_node)
      type(error_t), allocatable, intent(out) :: error

      call stepper_hold(face%stepper, held, error)
      if (.not. allocated(error)) call stepper_build(face%stepper, error)
   end subroutine face_build

   !> How many constraints are possible.
   pure integer function face_n(face)
      type(face_t), intent(in) :: face

      face_n = face%stepper%march%system%n_constraint
   end function face_n

   subroutine truss_begin(self)
      type(truss_t), intent(out) :: self

      allocate(self%x(2, 0), self%u(2, 0), self%v(2, 0), self%mass(0), self%bar(2, 0))
   end subroutine truss_begin

   !> Add a strip of n cells between two rows of nodes, the lower one first, with both diagonals;
   !> the masses are 1.
   subroutine truss_add(self, n, low, extent, v)
      type(truss_t), intent(inout) :: self
      integer, intent(in) :: n
      real(wp), intent(in) :: low(2), extent(2)
      real(wp), intent(in) :: v(2)
      integer :: i, j, m, before

      before = size(self%mass)
      m = n + 1
      do j = 0, 1
         do i = 0, n
            self%x = reshape([self%x, low + extent*[real(i, wp)/real(n, wp), real(j, wp)]], &
               [2, size(self%x, 2) + 1])
         end do
         self%bar = reshape([self%bar, (before + j*m + [i, i + 1], i = 1, n)], &
            [2, size(self%bar, 2) + n])
      end do
      self%bar = reshape([self%bar, (before + [i, m + i], i = 1, m), &
         (before + [i, m + i + 1, i + 1, m + i], i = 1, n)], [2, size(self%bar, 2) + m + 2*n])
      self%v = reshape([self%v, (v, i = 1, 2*m)], shape(self%x))
      self%u = 0.0_wp*self%x
      self%mass = [self%mass, (1.0_wp, i = 1, 2*m)]
   end subroutine truss_add

   !> Kinetic energy and that of the bars.
   pure real(wp) function truss_energy(self)
      type(truss_t), intent(in) :: self
      integer :: k

      truss_energy = 0.5_wp*sum(self%mass*sum(self%v**2, 1))
      do k = 1, size(self%bar, 2)
         associate (length => norm2(side(self%x, self%bar(:, k))))
            truss_energy = truss_energy &
               + 0.5_wp*self%stiffness*length*strain(self%x, self%u, self%bar(:, k))**2
         end associate
      end do
   end function truss_energy

   !> Momentum in x and y, and angular momentum.
   pure function truss_momentum(self) result(momentum)
      type(truss_t), intent(in) :: self
      real(wp) :: momentum(3)

      associate (q => self%x + self%u)
         momentum(1) = sum(self%mass*self%v(1, :))
         momentum(2) = sum(self%mass*self%v(2, :))
         momentum(3) = sum(self%mass*(q(1, :)*self%v(2, :) - q(2, :)*self%v(1, :)))
      end associate
   end function truss_momentum

   pure function side(field, bar)
      real(wp), intent(in) :: field(:, :)
      integer, intent(in) :: bar(2)
      real(wp) :: side(2)

      side = field(:, bar(2)) - field(:, bar(1))
   end function side

   !> (l^2 - L^2)/(2 L^2), from displacements.
   pure real(wp) function strain(x, u, bar)
      real(wp), intent(in) :: x(:, :), u(:, :)
      integer, intent(in) :: bar(2)

      associate (a => side(x, bar), b => side(u, bar))
         strain = dot_product(a + 0.5_wp*b, b)/dot_product(a, a)
      end associate
   end function strain

   !> Residual of the step without contact, its tangent, and the sizes of what it consists of.
   pure subroutine truss_respond(self, h, du, residual, tangent, magnitude)
      type(truss_t), intent(in) :: self
      real(wp), intent(in) :: h
      real(wp), intent(in) :: du(:, :)
      real(wp), intent(out) :: residual(:, :), tangent(:, :), magnitude(:, :)
      real(wp) :: middle(2), force(2), stress, block(2, 2)
      integer :: a, i, k, dof(4)

      tangent = 0.0_wp
      do i = 1, size(self%mass)
         residual(:, i) = self%mass(i)*(2.0_wp/h)*(du(:, i)/h - self%v(:, i))
         magnitude(:, i) = self%mass(i)*(2.0_wp/h)*(abs(du(:, i)/h) + abs(self%v(:, i)))
         do a = 2*i - 1, 2*i
            tangent(a, a) = self%mass(i)*2.0_wp/h**2
         end do
      end do
      do k = 1, size(self%bar, 2)
         associate (bar => self%bar(:, k), square => sum(side(self%x, self%bar(:, k))**2))
            middle = side(self%x, bar) + (side(self%u, bar) + 0.5_wp*side(du, bar))
            stress = 0.5_wp*self%stiffness/sqrt(square) &
               *(strain(self%x, self%u, bar) + strain(self%x, self%u + du, bar))
            force = stress*middle
            residual(:, bar(2)) = residual(:, bar(2)) + force
            residual(:, bar(1)) = residual(:, bar(1)) - force
            magnitude(:, bar) = magnitude(:, bar) + spread(abs(force), 2, 2)
            block = 0.5_wp*self%stiffness/sqrt(square)/square*spread(middle, 2, 2) &
               *spread(side(self%x, bar) + (side(self%u, bar) + side(du, bar)), 1, 2)
            block(1, 1) = block(1, 1) + 0.5_wp*stress
            block(2, 2) = block(2, 2) + 0.5_wp*stress
            dof = [2*bar(1) - 1, 2*bar(1), 2*bar(2) - 1, 2*bar(2)]
            tangent(dof(:2), dof(:2)) = tangent(dof(:2), dof(:2)) + block
            tangent(dof(3:), dof(3:)) = tangent(dof(3:), dof(3:)) + block
            tangent(dof(:2), dof(3:)) = tangent(dof(:2), dof(3:)) - block
            tangent(dof(3:), dof(:2)) = tangent(dof(3:), dof(:2)) - block
         end associate
      end do
   end subroutine truss_respond

   !> One energy-momentum step of size `h`; the active set and contact are the library's.
   subroutine truss_step(self, face, h, error)
      type(truss_t), intent(inout) :: self
      type(face_t), intent(inout) :: face
      real(wp), intent(in) :: h
      type(error_t), allocatable, intent(out) :: error
      real(wp), allocatable :: du(:, :), magnitude(:, :), lam(:)
      logical, allocatable :: active(:)
      integer, allocatable :: redundant(:)
      integer :: status, i_set
      logical :: is_done

      allocate(du, source=h*self%v)
      allocate(magnitude, mold=du)
      call query_begin_contact(face%query, face%stepper, self%u, du, self%is_active, active, error)
      do i_set = 1, most_sets
         if (allocated(error)) return
         call query_select(face%query, face%stepper, self%u, du, active, error)
         if (allocated(error)) return
         call solve(self, face, h, du, lam, magnitude, redundant, error)
         if (allocated(error)) return
         if (size(redundant) > 0) then
            call query_drop(face%query, redundant, active, error)
            cycle
         end if
         call query_update_active(face%query, face%stepper, self%u, du, lam, active, is_done, &
            status, error, magnitude)
         if (allocated(error)) return
         if (.not. is_done) cycle
         if (status /= step_done) exit
         self%u = self%u + du
         self%v = (2.0_wp/h)*du - self%v
         self%is_active = active
         self%n_contact = count(active)
         return
      end do
      call raise(error, err_analysis, "the step failed, status " // to_text(status))
   end subroutine truss_step

   !> Newton's method in the null space of the selected constraints, until nothing moves any more.
   subroutine solve(self, face, h, du, lam, magnitude, redundant, error)
      type(truss_t), intent(in) :: self
      type(face_t), intent(inout) :: face
      real(wp), intent(in) :: h
      real(wp), intent(inout) :: du(:, :)
      real(wp), allocatable, intent(out) :: lam(:)
      real(wp), intent(out) :: magnitude(:, :)
      integer, allocatable, intent(out) :: redundant(:)
      type(error_t), allocatable, intent(out) :: error
      type(contact_report_t) :: values
      type(csr_t) :: p, df, curvature
      real(wp) :: residual(2, size(du, 2)), tangent(size(du), size(du))
      real(wp), allocatable :: part(:, :), reduced(:, :), rhs(:), all(:)
      real(dp), allocatable :: x(:, :)
      real(wp) :: step, last
      integer :: iteration
      logical :: is_singular

      last = huge(last)
      do iteration = 1, most_iterations
         call truss_respond(self, h, du, residual, tangent, magnitude)
         call query_contact(face%query, face%stepper, self%u, du, values, error)
         if (allocated(error)) return
         call query_null_space(face%query, p, df, redundant, error)
         if (allocated(error) .or. size(redundant) > 0) return
         call query_multipliers(face%query, face%stepper, all, error, residual)
         if (allocated(error)) return
         lam = all(values%id)
         call query_curvature(face%query, lam, curvature, error)
         if (allocated(error)) return
         tangent = tangent - real(dense_of(curvature), wp)
         call query_particular(face%query, face%stepper, values%defect, part, error)
         if (allocated(error)) return
         associate (pw => real(dense_of(p), wp), dfw => real(dense_of(df), wp), &
               r => reshape(residual, [size(du)]), first => reshape(part, [size(du)]))
            rhs = -matmul(r + matmul(tangent, first), pw)
            reduced = matmul(transpose(pw), matmul(tangent, dfw))
            if (allocated(x)) deallocate(x)
            allocate(x(size(rhs), 1))
            call dense_solve(real(reduced, dp), reshape(real(rhs, dp), [size(rhs), 1]), x, &
               is_singular)
            part = part + reshape(matmul(dfw, real(x(:, 1), wp)), shape(part))
         end associate
         du = du + part
         step = maxval(abs(part))
         if (step <= 4.0_wp*epsilon(step)*maxval(abs(self%x))) return
         if (iteration > 5 .and. .not. step < last) return
         last = step
      end do
   end subroutine solve

end module truss_host
