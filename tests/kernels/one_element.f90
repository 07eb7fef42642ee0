!> Decks of one element, of every kind and law, for the tests.
module one_element
   use emcon_diagnostics, only : diagnostics_t
   use emcon_errors, only : error_t
   use emcon_kinds, only : wp
   use emcon_stepper, only : stepper_read_source, stepper_t
   implicit none
   private
   public :: read_one, n_law, law_given

   !> Laws of decks; behind them one that a program gives.
   integer, parameter :: n_law = 6, law_given = 7
   integer, parameter :: most_nodes = 20
   character(len=28), parameter :: law_card(law_given) = [character(len=28) :: "*ELASTIC", &
      "*HYPERELASTIC, NEO HOOKE", "*HYPERELASTIC, COUPLED NEO H", "*HYPERELASTIC, MOONEY-RIVLIN", &
      "*HYPERELASTIC, YEOH", "*HYPERELASTIC, OGDEN, N=2", &
      "*USER MATERIAL, CONSTANTS=1"]
   character(len=40), parameter :: law_data(law_given) = [character(len=40) :: "100., 0.3", &
      "20., 0.05", "100., 0.3", "15., 5., 0.05", "20., 3., 2., 0.05, 0.02, 0.01", &
      "20., 2.5, 10., -2., 0.05, 0.02", "1."]

contains

   !> Places of the nodes; rings are at radii from 2 on.
   pure subroutine place_nodes(kind, n_dim, n, x)
      character(len=*), intent(in) :: kind
      integer, intent(out) :: n_dim, n
      real(wp), intent(out) :: x(3, most_nodes)
      integer, parameter :: of_plane(2, 4) = reshape([1, 2, 2, 3, 3, 4, 4, 1], [2, 4]), &
         of_tetrahedron(2, 6) = reshape([1, 2, 2, 3, 3, 1, 1, 4, 2, 4, 3, 4], [2, 6]), &
         of_hexahedron(2, 12) = reshape([1, 2, 2, 3, 3, 4, 4, 1, 5, 6, 6, 7, 7, 8, 8, 5, 1, 5, &
         2, 6, 3, 7, 4, 8], [2, 12])
      integer :: n_corner, ends(2), i

      x = 0.0_wp
      n_dim = merge(3, 2, kind(:3) == "C3D")
      read(kind(4:), "(i1)") n
      if (kind(4:5) == "10" .or. kind(4:5) == "20") read(kind(4:5), "(i2)") n
      x(:2, :4) = reshape([0.0_wp, 0.0_wp, 1.2_wp, 0.1_wp, 1.1_wp, 0.9_wp, -0.1_wp, 1.0_wp], [2, 4])
      if (kind(:3) == "CAX") x(1, :4) = x(1, :4) + 2.0_wp
      n_corner = merge(3, 4, n == 3 .or. n == 6)
      if (n_dim == 3 .and. (n == 8 .or. n == 20)) then
         n_corner = 8
         x(:2, 5:8) = x(:2, :4) + 0.1_wp
         x(3, 5:8) = [1.0_wp, 1.1_wp, 0.9_wp, 1.05_wp]
      else if (n_dim == 3) then
         x(:, 4) = [0.2_wp, 0.3_wp, 0.9_wp]
      end if
      do i = n_corner + 1, n
         if (n_dim == 2) ends = of_plane(:, i - n_corner)
         if (n_corner == 3 .and. i == n) ends = [3, 1]
         if (n == 10) ends = of_tetrahedron(:, i - n_corner)
         if (n == 20) ends = of_hexahedron(:, i - n_corner)
         x(:, i) = 0.5_wp*(x(:, ends(1)) + x(:, ends(2)))
      end do
   end subroutine place_nodes

   !> Read the deck of one element that nothing holds; its material is M.
   subroutine read_one(kind, law, kinematics, stepper, error, of_model, of_step)
      character(len=*), intent(in) :: kind, kinematics
      integer, intent(in) :: law
      type(stepper_t), intent(inout) :: stepper
      type(error_t), allocatable, intent(out) :: error
      !> Further lines: behind the density of the material, and behind the step's duration
      character(len=*), intent(in), optional :: of_model(:), of_step(:)
      type(diagnostics_t) :: diagnostics
      character(len=100) :: line(60)
      real(wp) :: x(3, most_nodes)
      integer :: n_dim, n, m, i

      call place_nodes(kind, n_dim, n, x)
      line(1) = "*NODE"
      do i = 1, n
         write(line(1 + i), "(i0, 3(', ', es24.16))") i, x(:n_dim, i)
      end do
      m = n + 1
      call add("*ELEMENT, TYPE=" // trim(kind) // ", ELSET=B")
      m = m + 1
      write(line(m), "(i0, 15(', ', i0))") 1, [(i, i = 1, min(n, 15))]
      if (n > 15) then
         line(m) = trim(line(m)) // ","
         m = m + 1
         write(line(m), "(i0, 15(', ', i0))") [(i, i = 16, n)]
      end if
      call add("*MATERIAL, NAME=M")
      call add(trim(law_card(law)) // merge("OOKE", "    ", law == 3))
      call add(law_data(law))
      call add("*DENSITY")
      call add("1.")
      if (present(of_model)) call add_all(of_model)
      call add("*SOLID SECTION, ELSET=B, MATERIAL=M, KINEMATICS=" // kinematics)
      if (n_dim == 2 .and. kind(:3) /= "CAX") call add("0.5")
      call add("*STEP, NLGEOM")
      call add("*DYNAMIC, DIRECT")
      call add("0.1, 1.")
      if (present(of_step)) call add_all(of_step)
      call add("*END STEP")
      allocate(stepper%source%line(m), stepper%source%file_name(1), stepper%override(0))
      stepper%source%file_name(1)%text = "one.inp"
      do i = 1, m
         stepper%source%line(i)%text = trim(line(i))
      end do
      allocate(stepper%source%file(m), source=1)
      stepper%source%number = [(i, i = 1, m)]
      diagnostics%file_name = stepper%source%file_name
      call stepper_read_source(stepper, diagnostics, error)

   contains

      subroutine add(text)
         character(len=*), intent(in) :: text

         m = m + 1
         line(m) = text
      end subroutine add

      subroutine add_all(text)
         character(len=*), intent(in) :: text(:)
         integer :: k

         do k = 1, size(text)
            call add(text(k))
         end do
      end subroutine add_all

   end subroutine read_one

end module one_element
