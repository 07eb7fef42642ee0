!> A code with a solid of its own, in Fortran: what host_solid.c is in C, with the same figures.
!>
!> Triangles that the library does not know stand on a bed of springs, and a block of the library's
!> elements, of a law that is given too, falls on them. The host gives mass, forces and tangent.
module triangle_host
   use emcon_api, only : csr_from_elements, csr_t, dp, error_t, force_response_t, host_force_t, &
      host_ok, host_outside, point_function_t, point_ok, point_outside, wp
   implicit none
   private
   public :: triangles_t, springs_t, foam_t, triangles_init, density

   real(wp), parameter :: modulus = 200.0_wp, shear = 100.0_wp, density = 1.0_wp

   !> Triangles of St. Venant and Kirchhoff's law, of constant strain.
   type, extends(host_force_t) :: triangles_t
      real(wp), allocatable :: x(:, :)           !! (2, n_node)
      integer, allocatable :: node(:, :)         !! (3, n_triangle)
      integer, allocatable :: slot(:)            !! (36 n_triangle) of the tangent, in its pattern
   contains
      procedure :: respond
   end type triangles_t

   !> k y^2/2 at each point.
   type, extends(point_function_t) :: springs_t
      real(wp) :: k = 50.0_wp
   contains
      procedure :: evaluate => springs_evaluate
   end type springs_t

   !> A law that gets stiffer: lambda tr^2/2 + mu q + c q^2/2, of q = |E|^2.
   type, extends(point_function_t) :: foam_t
      real(wp) :: c = 1.0e4_wp
   contains
      procedure :: evaluate => foam_evaluate
   end type foam_t

contains

   !> The triangles `node` between nodes at `x`: their pattern, and their mass.
   subroutine triangles_init(self, x, node, mass, error)
      type(triangles_t), intent(out) :: self
      real(wp), intent(in) :: x(:, :)
      integer, intent(in) :: node(:, :)
      type(csr_t), intent(out) :: mass
      type(error_t), allocatable, intent(out) :: error
      integer, allocatable :: slot(:)
      integer :: a, b, i, n, t
      real(wp) :: gradient(2, 3), area

      self%name = "triangles"
      self%x = x
      self%node = node
      n = size(node, 2)
      call csr_from_elements(self%pattern, 2*size(x, 2), [(6*i + 1, i = 0, n)], &
         [(((2*(node(a, t) - 1) + i, i = 1, 2), a = 1, 3), t = 1, n)], self%slot, error)
      if (.not. allocated(error)) call csr_from_elements(mass, size(x, 2), &
         [(3*i + 1, i = 0, n)], reshape(node, [3*n]), slot, error)
      if (allocated(error)) return
      do t = 1, n
         call shape_of(self, t, gradient, area)
         do b = 1, 3
            do a = 1, 3
               associate (entry => mass%value(slot(9*(t - 1) + 3*(b - 1) + a)))
                  entry = entry + real(density*area/merge(6, 12, a == b), dp)
               end associate
            end do
         end do
      end do
   end subroutine triangles_init

   !> Gradients of the shape functions; the area.
   pure subroutine shape_of(self, t, gradient, area)
      type(triangles_t), intent(in) :: self
      integer, intent(in) :: t
      real(wp), intent(out) :: gradient(2, 3), area
      integer :: a

      associate (x => self%x(:, self%node(:, t)))
         do a = 1, 3
            associate (side => x(:, 1 + mod(a, 3)) - x(:, 1 + mod(a + 1, 3)))
               gradient(:, a) = [side(2), -side(1)]
            end associate
         end do
         area = 0.5_wp*dot_product(gradient(1, :), x(1, :))
      end associate
      gradient = gradient/(2.0_wp*area)
   end subroutine shape_of

   !> F, and the strains E11, E22, 2 E12, in which rigid motion does not cancel.
   pure subroutine strain_of(gradient, u, f, e)
      real(wp), intent(in) :: gradient(2, 3), u(2, 3)
      real(wp), intent(out) :: f(2, 2), e(3)
      real(wp) :: g(2, 2)

      g = matmul(u(:, 2:) - spread(u(:, 1), 2, 2), transpose(gradient(:, 2:)))
      e = [g(1, 1) + 0.5_wp*sum(g(:, 1)**2), g(2, 2) + 0.5_wp*sum(g(:, 2)**2), &
         g(1, 2) + g(2, 1) + dot_product(g(:, 1), g(:, 2))]
      f = g
      f(1, 1) = 1.0_wp + g(1, 1)
      f(2, 2) = 1.0_wp + g(2, 2)
   end subroutine strain_of

   !> (3 x 6) derivatives of the strains by the displacements.
   pure function strain_rows(gradient, f) result(b)
      real(wp), intent(in) :: gradient(2, 3), f(2, 2)
      real(wp) :: b(3, 6)
      integer :: a

      do a = 1, 3
         b(1, 2*a - 1:2*a) = f(:, 1)*gradient(1, a)
         b(2, 2*a - 1:2*a) = f(:, 2)*gradient(2, a)
         b(3, 2*a - 1:2*a) = f(:, 1)*gradient(2, a) + f(:, 2)*gradient(1, a)
      end do
   end function strain_rows

   !> The stress of the mean of the strains, on the displacements in the middle: forces . du is the
   !> change of the energy exactly.
   subroutine respond(self, u0, du, wants_tangent, response)
      class(triangles_t), intent(inout) :: self
      real(wp), intent(in), contiguous :: u0(:, :), du(:, :)
      logical, intent(in) :: wants_tangent
      type(force_response_t), intent(inout) :: response
      real(wp), parameter :: law(3, 3) = reshape([modulus + 2.0_wp*shear, modulus, 0.0_wp, &
         modulus, modulus + 2.0_wp*shear, 0.0_wp, 0.0_wp, 0.0_wp, shear], [3, 3])
      real(wp) :: gradient(2, 3), area, f0(2, 2), f1(2, 2), e0(3), e1(3), stress(3), rows(3, 6)
      integer :: t

      response%status = host_outside
      do t = 1, size(self%node, 2)
         associate (node => self%node(:, t))
            call shape_of(self, t, gradient, area)
            call strain_of(gradient, u0(:, node), f0, e0)
            call strain_of(gradient, u0(:, node) + du(:, node), f1, e1)
            if (.not. f1(1, 1)*f1(2, 2) - f1(1, 2)*f1(2, 1) > 0.0_wp) return
            stress = matmul(law, 0.5_wp*(e0 + e1))
            rows = strain_rows(gradient, 0.5_wp*(f0 + f1))
            response%energy = response%energy + 0.5_wp*area*dot_product(e1, matmul(law, e1))
            response%force(:, node) = response%force(:, node) &
               + reshape(area*matmul(stress, rows), [2, 3])
            response%magnitude(:, node) = response%magnitude(:, node) &
               + reshape(area*matmul(abs(stress), abs(rows)), [2, 3])
            if (wants_tangent) call add_tangent()
         end associate
      end do
      response%status = host_ok

   contains

      !> The derivative of the forces by the end of the step.
      subroutine add_tangent()
         real(wp) :: k(6, 6), initial
         integer :: a, b

         k = matmul(transpose(rows), matmul(law, strain_rows(gradient, f1)))
         do b = 1, 3
            do a = 1, 3
               initial = gradient(1, a)*stress(1)*gradient(1, b) &
                  + gradient(2, a)*stress(2)*gradient(2, b) + stress(3) &
                  *(gradient(1, a)*gradient(2, b) + gradient(2, a)*gradient(1, b))
               k(2*a - 1, 2*b - 1) = k(2*a - 1, 2*b - 1) + initial
               k(2*a, 2*b) = k(2*a, 2*b) + initial
            end do
         end do
         k = 0.5_wp*area*k
         associate (slot => reshape(self%slot(36*(t - 1) + 1:36*t), [6, 6]))
            do b = 1, 6
               do a = 1, 6
                  response%tangent(slot(a, b)) = response%tangent(slot(a, b)) + real(k(a, b), dp)
               end do
            end do
         end associate
      end subroutine add_tangent

   end subroutine respond

   subroutine springs_evaluate(self, z, wants_hessian, value, gradient, hessian, status)
      class(springs_t), intent(in) :: self
      real(wp), intent(in), contiguous :: z(:, :)
      logical, intent(in) :: wants_hessian
      real(wp), intent(inout), contiguous :: value(:), gradient(:, :), hessian(:, :, :)
      integer, intent(out) :: status

      status = point_ok
      value = 0.5_wp*self%k*z(2, :)**2
      gradient(1, :) = 0.0_wp
      gradient(2, :) = self%k*z(2, :)
      if (.not. wants_hessian) return
      hessian = 0.0_wp
      hessian(2, 2, :) = self%k
   end subroutine springs_evaluate

   subroutine foam_evaluate(self, z, wants_hessian, value, gradient, hessian, status)
      class(foam_t), intent(in) :: self
      real(wp), intent(in), contiguous :: z(:, :)
      logical, intent(in) :: wants_hessian
      real(wp), intent(inout), contiguous :: value(:), gradient(:, :), hessian(:, :, :)
      integer, intent(out) :: status
      real(wp), parameter :: twice(3) = [2.0_wp, 2.0_wp, 1.0_wp]
      real(wp) :: trace, q, slope
      integer :: i, p

      status = point_outside
      do p = 1, size(z, 2)
         associate (e => z(:, p))
            if (.not. (1.0_wp + 2.0_wp*e(1))*(1.0_wp + 2.0_wp*e(2)) > e(3)**2) return
            trace = e(1) + e(2)
            q = 0.5_wp*sum(twice*e**2)
            slope = shear + self%c*q
            value(p) = 0.5_wp*modulus*trace**2 + shear*q + 0.5_wp*self%c*q**2
            gradient(:, p) = modulus*trace*[1.0_wp, 1.0_wp, 0.0_wp] + slope*twice*e
            if (.not. wants_hessian) cycle
            hessian(:, :, p) = self%c*spread(twice*e, 2, 3)*spread(twice*e, 1, 3)
            hessian(:2, :2, p) = hessian(:2, :2, p) + modulus
            do i = 1, 3
               hessian(i, i, p) = hessian(i, i, p) + slope*twice(i)
            end do
         end associate
      end do
      status = point_ok
   end subroutine foam_evaluate

end module triangle_host

!> usage: fortran_solid FORMULATION [H]
program fortran_solid
   use emcon_api, only : csr_t, error_t, increment_t, passage_t, stepper_advance, &
      stepper_build, stepper_close, stepper_give_force, stepper_give_law, stepper_give_mass, &
      stepper_give_potential, stepper_is_done, stepper_read_text, stepper_t, string_t, wp
   use triangle_host, only : density, foam_t, springs_t, triangles_init, triangles_t
   implicit none
   integer, parameter :: nx = 6, ny = 2, mx = 5, my = 2      ! squares of the solid, of the block
   integer, parameter :: n_host = (nx + 1)*(ny + 1), n_node = n_host + (mx + 1)*(my + 1)
   type(stepper_t) :: model
   type(triangles_t) :: solid
   type(springs_t) :: springs
   type(foam_t) :: foam
   type(csr_t) :: mass
   type(string_t) :: name(1), parameter(0)
   type(increment_t) :: increment
   type(error_t), allocatable :: error
   character(len=:), allocatable :: deck
   character(len=80) :: formulation, h
   real(wp) :: x(2, n_node)
   integer :: node(3, 2*nx*ny), i, j, k

   call get_command_argument(1, formulation)
   call get_command_argument(2, h)
   if (h == "") h = "0.01"
   k = 0
   call place(nx, ny, [0.0_wp, 0.0_wp], [3.0_wp, 1.0_wp])
   call place(mx, my, [0.7_wp, 1.05_wp], [1.5_wp, 0.6_wp])
   k = 0
   do j = 0, ny - 1
      do i = 1, nx
         associate (a => j*(nx + 1) + i, b => (j + 1)*(nx + 1) + i)
            node(:, k + 1) = [a, a + 1, b + 1]
            node(:, k + 2) = [a, b + 1, b]
         end associate
         k = k + 2
      end do
   end do
   call triangles_init(solid, x, node, mass, error)
   call require()
   call write_deck()
   name(1)%text = "fortran_solid"
   call stepper_read_text(model, deck, [passage_t()], name, parameter, .false., error)
   deallocate(deck)
   call require()
   call stepper_give_mass(model, mass, error)
   call require()
   call stepper_give_force(model, solid, error)
   call require()
   springs%n_variable = 2
   call stepper_give_potential(model, "bed", [(i, i = 1, nx + 1)], springs, error)
   call require()
   foam%n_variable = 3
   call stepper_give_law(model, "FOAM", foam, error)
   call require()
   call stepper_build(model, error)
   call require()
   increment = increment_t()
   do
      associate (ledger => model%march%ledger)
         print "(7(es24.16, 1x), i0)", model%march%state%clock%time, ledger%total, ledger%kinetic, &
            ledger%strain, ledger%potential, ledger%momentum, increment%n_active
      end associate
      if (stepper_is_done(model)) exit
      call stepper_advance(model, increment, error)
      call require()
   end do
   call stepper_close(model)

contains

   subroutine require()
      if (.not. allocated(error)) return
      print "(a, i0, 2a)", "error ", error%code, ": ", error%message
      call stepper_close(model)
      stop 1
   end subroutine require

   !> Nodes of a grid of n x m squares, row by row upwards.
   subroutine place(n, m, corner, extent)
      integer, intent(in) :: n, m
      real(wp), intent(in) :: corner(2), extent(2)
      integer :: i, j

      do j = 0, m
         do i = 0, n
            k = k + 1
            x(:, k) = corner + extent*[i, j]/[n, m]
         end do
      end do
   end subroutine place

   subroutine add(line)
      character(len=*), intent(in) :: line

      deck = deck // line // new_line("a")
   end subroutine add

   subroutine add_labels(label)
      integer, intent(in) :: label(:)
      character(len=100) :: line

      write (line, "(*(i0, :, ', '))") label
      call add(trim(line))
   end subroutine add_labels

   !> Nodes, the block, surfaces and the step.
   subroutine write_deck()
      character(len=100) :: line
      integer :: i, j, a

      deck = ""
      call add("*NODE")
      do i = 1, n_node
         write (line, "(i0, 2(', ', es24.16))") i, x(:, i)
         call add(trim(line))
      end do
      call add("*ELEMENT, TYPE=CPE4, ELSET=BLOCK")
      do j = 0, my - 1
         do i = 1, mx
            a = n_host + j*(mx + 1) + i
            call add_labels([j*mx + i, a, a + 1, a + mx + 2, a + mx + 1])
         end do
      end do
      call add("*ELSET, ELSET=LOWEST, GENERATE")
      call add_labels([1, mx])
      call add("*NSET, NSET=FALLING, GENERATE")
      call add_labels([n_host + 1, n_node])
      call add("*GIVEN FORCES")
      call add("*MATERIAL, NAME=FOAM")
      call add("*USER MATERIAL")
      call add("*DENSITY")
      write (line, "(es24.16)") density
      call add(trim(line))
      call add("*SOLID SECTION, ELSET=BLOCK, MATERIAL=FOAM")
      call add("*SURFACE, NAME=BLOCK")
      call add("LOWEST, S1")
      call add("*SURFACE, NAME=SOLID, TYPE=EDGE")
      do i = n_host, n_host - nx + 1, -1
         call add_labels([i, i - 1])
      end do
      call add("*SURFACE INTERACTION, NAME=HARD")
      call add("*CONTACT PAIR, INTERACTION=HARD, TYPE=" // trim(formulation))
      call add("BLOCK, SOLID")
      call add("*INITIAL CONDITIONS, TYPE=VELOCITY")
      call add("FALLING, 1, 0.3")
      call add("FALLING, 2, -1.")
      call add("*STEP, NLGEOM")
      call add("*DYNAMIC")
      call add(trim(h) // ", 0.5")
      call add("*END STEP")
   end subroutine write_deck

end program fortran_solid
