!> Time per element: forces, and forces with tangent, of every law on CPE4 and CPE3, and on
!> elements of three dimensions.
!>
!> Prints a table; asserts nothing. The time is the least of several runs over a block of elements
!> at strains of some ten percent, with the way from the nodes and back to them: `respond` of
!> `emcon_solid_term`. Each entry of a matrix has a place of its own.
program bench_element
   use, intrinsic :: iso_fortran_env, only : output_unit
   use emcon_csr, only : csr_t
   use emcon_element_kind, only : find_element_kind
   use emcon_element_registry, only : element_kinds_create, find_element_row
   use emcon_errors, only : error_t
   use emcon_kinds, only : dp, int64, wp
   use emcon_law_registry, only : law_row, law_row_t, n_constant, n_law_row
   use emcon_motion, only : motion_t, motion_init, motion_evaluate
   use emcon_scene, only : scene_t
   use emcon_solid_term, only : solid_term_init, solid_term_t
   use emcon_space, only : space_t
   use emcon_term, only : response_begin, response_init, response_t
   implicit none
   integer, parameter :: n_side = 40, n_run = 25
   integer, parameter :: n_cube = 6
   character(len=6), parameter :: kind_name(9) = [character(len=6) :: "CPE4", "CPE3", "C3D8", &
      "C3D8H", "C3D8I", "C3D4", "C3D10", "C3D20", "C3D20R"]
   !> In the order of the names that laws have for their constants.
   character(len=6), parameter :: names(14) = [character(len=6) :: "E", "nu", "C10", "D1", "C01", &
      "C20", "C30", "D2", "D3", "mu1", "alpha1", "mu2", "alpha2", "mu3"]
   real(wp), parameter :: values(14) = [3.0_wp, 0.3_wp, 0.5_wp, 0.4_wp, 0.1_wp, -0.03_wp, &
      0.01_wp, 3.0_wp, 5.0_wp, 1.0_wp, 1.3_wp, 0.2_wp, 4.0_wp, 0.1_wp]
   integer :: i_kind, i_law

   write(output_unit, "(/, a)") "Elements, microseconds each"
   write(output_unit, "(a6, 1x, a18, 2a18)") "kind", "law", "forces", "and tangent"
   do i_kind = 1, size(kind_name)
      do i_law = 1, n_law_row()
         call bench(kind_name(i_kind), i_law)
      end do
   end do

contains

   subroutine bench(kind, i_law)
      character(len=*), intent(in) :: kind
      integer, intent(in) :: i_law               !! row
      type(scene_t) :: scene
      type(solid_term_t) :: term
      type(motion_t) :: motion
      type(response_t) :: response
      type(space_t) :: space
      type(csr_t) :: matrix
      type(law_row_t) :: row
      type(error_t), allocatable :: error
      real(dp), allocatable :: value(:)
      real(dp) :: side(1), seconds(2)
      integer, allocatable :: slot(:)
      integer :: i, n

      if (kind(:3) == "C3D") then
         call make_cubes(kind, scene)
      else
         call make_squares(kind, scene)
      end if
      call finish_scene(i_law, scene)
      call solid_term_init(term, scene, error)
      if (allocated(error)) then
         write(output_unit, "(a)") error%message
         return
      end if
      n = size(scene%x, 1)**2*sum(count(scene%element%node > 0, 1)**2)
      allocate(slot(n), source=[(i, i = 1, n)])
      allocate(value(n), source=0.0_dp)
      call term%begin_step(scene, 1, space, matrix, slot)
      call response_init(response, size(scene%x, 1), size(scene%x, 2), size(scene%element%kind))
      call motion_init(motion, scene%x)
      motion%evaluation%at = 1.0_wp
      motion%evaluation%is_gradient = .false.
      call random_number(motion%u0)
      call random_number(motion%du)
      motion%u0 = 0.06_wp*motion%u0
      motion%u0(:2, :) = motion%u0(:2, :) + 0.1_wp*scene%x(:2, :)
      motion%du = 0.06_wp*motion%du
      call motion_evaluate(motion)
      seconds = huge(seconds)
      do i = 1, n_run
         call time_of(term, motion, response, seconds(1))
         call time_of(term, motion, response, seconds(2), value, side)
      end do
      row = law_row(i_law)
      write(output_unit, "(a6, 1x, a18, 2f18.3)") kind, row%name, &
         1.0e6_dp*seconds/real(size(scene%element%kind), dp)
   end subroutine bench

   subroutine time_of(term, motion, response, least, value, side)
      type(solid_term_t), intent(inout) :: term
      type(motion_t), intent(in) :: motion
      type(response_t), intent(inout) :: response
      real(dp), intent(inout) :: least           !! so far [s]
      real(dp), intent(inout), contiguous, optional :: value(:), side(:)
      integer(int64) :: begin, end, rate

      call response_begin(response)
      call system_clock(begin, rate)
      call term%respond(motion, response, value, side)
      call system_clock(end)
      least = min(least, real(end - begin, dp)/real(rate, dp))
      if (allocated(response%refusal)) write(output_unit, "(a)") response%refusal
   end subroutine time_of

   !> A block of square elements, or of their halves.
   subroutine make_squares(kind, scene)
      character(len=*), intent(in) :: kind
      type(scene_t), intent(out) :: scene
      integer :: i, j, e, corner(4), n

      call element_kinds_create(2, scene%element%kinds)
      n = n_side**2*merge(1, 2, kind == "CPE4")
      allocate(scene%x(2, (n_side + 1)**2), scene%element%node(4, n))
      allocate(scene%element%kind(n), source=find_element_row(kind))
      scene%element%node = 0
      e = 0
      do j = 0, n_side
         do i = 0, n_side
            scene%x(:, 1 + i + (n_side + 1)*j) = real([i, j], wp)
            if (i == n_side .or. j == n_side) cycle
            corner = 1 + i + (n_side + 1)*j + [0, 1, n_side + 2, n_side + 1]
            e = e + 1
            if (kind == "CPE4") then
               scene%element%node(:, e) = corner
            else
               scene%element%node(:3, e) = corner(:3)
               e = e + 1
               scene%element%node(:3, e) = corner([1, 3, 4])
            end if
         end do
      end do
   end subroutine make_squares

   !> Cubes, each with nodes of its own, or what fills the half of one.
   subroutine make_cubes(kind, scene)
      character(len=*), intent(in) :: kind
      type(scene_t), intent(out) :: scene
      real(wp), allocatable :: place(:, :)
      integer :: e, i, n

      call element_kinds_create(3, scene%element%kinds)
      i = find_element_kind(scene%element%kinds, kind)
      call scene%element%kinds(i)%shape%places(place)
      n = size(place, 2)
      allocate(scene%x(3, n*n_cube**3), scene%element%node(n, n_cube**3))
      allocate(scene%element%kind(n_cube**3), source=i)
      do e = 1, n_cube**3
         scene%element%node(:, e) = [(n*(e - 1) + i, i = 1, n)]
         scene%x(:, scene%element%node(:, e)) = place
      end do
   end subroutine make_cubes

   !> What is left, with the constants of a law.
   subroutine finish_scene(i_law, scene)
      integer, intent(in) :: i_law
      type(scene_t), intent(inout) :: scene
      type(law_row_t) :: row
      integer :: i, j, n

      n = size(scene%element%kind)
      allocate(scene%rigid(0), scene%material(1), scene%section(1), scene%step(1), &
         scene%element%origin(n))
      allocate(scene%element%label(n), source=[(i, i = 1, n)])
      allocate(scene%element%section(n), source=1)
      scene%material(1)%name = "M"
      scene%material(1)%density = 1.0_wp
      row = law_row(i_law)
      scene%material(1)%law = row%code
      allocate(scene%material(1)%constant(n_constant(row)))
      do i = 1, size(scene%material(1)%constant)
         j = findloc(names, row%constant(i), 1)
         scene%material(1)%constant(i) = 2.0_wp
         if (j > 0) scene%material(1)%constant(i) = values(j)
      end do
      scene%section(1)%material = 1
      scene%step(1)%nlgeom = .true.
   end subroutine finish_scene

end program bench_element
