!> The largest step of central differences: 2 over the highest frequency of the tangent at a place.
!>
!> An element vibrates no slower by itself than in the company of others, which bounds the frequency
!> by the fastest element. The value itself comes from Lanczos' method, in the inner product of the
!> mass. Source: docs/theory.md, section 13.
module emcon_critical_step
   use emcon_constraint, only : condition_add_field, condition_rate
   use emcon_constraints, only : constraint_set_t
   use emcon_csr, only : csr_multiply, csr_t
   use emcon_errors, only : error_t
   use emcon_kinds, only : wp
   use emcon_motion, only : motion_t
   use emcon_numbering, only : add_to_dofs, pick_unknowns
   use emcon_solver_registry, only : solver_create, solver_default
   use emcon_sparse_solver, only : matrix_definite, sparse_solver_t
   use emcon_system, only : system_t, system_tangent_times
   use emcon_term, only : fastest_t
   use emcon_term_registry, only : terms_mass_rows, terms_mass_values
   implicit none
   private
   public :: critical_bound, critical_sharp, tridiagonal_largest

   !> Lanczos' method ends after so many vectors, and where so many more change its largest value by
   !> less than this part.
   integer, parameter :: most_vectors = 400, overlap_query_every = 10
   real(wp), parameter :: settled = 1.0e-9_wp

contains

   !> A step below the critical one, by the fastest element; `is_bounded`: there is no other
   !> stiffness.
   subroutine critical_bound(system, place, stiffness, h, element, is_bounded)
      type(system_t), intent(inout) :: system
      type(motion_t), intent(in) :: place        !! that rests, placed at its end
      real(wp), intent(in) :: stiffness(:)       !! (n_node) of what pushes single nodes [M/T^2]
      real(wp), intent(out) :: h                 !! huge: nothing vibrates [T]
      integer, intent(out) :: element            !! 0: none
      logical, intent(out) :: is_bounded         !! no other stiffness
      type(fastest_t) :: fastest
      real(wp) :: square
      integer :: k

      is_bounded = .true.
      do k = 1, size(system%term)
         call system%term(k)%term%find_fastest(place, fastest, is_bounded)
      end do
      element = fastest%element
      h = huge(h)
      call add_nodes(system, stiffness, fastest%square, square, is_bounded)
      if (square > 0.0_wp) h = 2.0_wp/sqrt(square)
   end subroutine critical_bound

   !> No frequency of two stiffnesses is higher than those of each together, in squares.
   pure subroutine add_nodes(system, stiffness, of_elements, square, is_bounded)
      type(system_t), intent(in) :: system
      real(wp), intent(in) :: stiffness(:)       !! (n_node) [M/T^2]
      real(wp), intent(in) :: of_elements        !! square of the fastest's frequency [1/T^2]
      real(wp), intent(out) :: square            !! of all [1/T^2]
      logical, intent(inout) :: is_bounded
      real(wp), allocatable :: mass(:)
      real(wp) :: largest
      integer :: i

      square = of_elements
      if (.not. any(stiffness > 0.0_wp)) return
      allocate(mass(size(stiffness)))
      call terms_mass_rows(system%term, mass)
      is_bounded = is_bounded .and. system%space%numbering%n_dependent == 0
      largest = 0.0_wp
      do i = 1, size(mass)
         if (.not. any(system%space%numbering%unknown(:, i) > 0)) cycle
         if (mass(i) > 0.0_wp) largest = max(largest, stiffness(i)/mass(i))
      end do
      square = square + largest
   end subroutine add_nodes

   !> The critical step of the unknowns of the step; the mass between them is definite.
   subroutine critical_sharp(system, place, stiffness, h, error, closed)
      type(system_t), intent(inout) :: system
      type(motion_t), intent(in) :: place        !! that rests, placed at its end
      real(wp), intent(in) :: stiffness(:)       !! (n_node) of what pushes single nodes [M/T^2]
      real(wp), intent(out) :: h                 !! huge: nothing vibrates [T]
      type(error_t), allocatable, intent(out) :: error
      type(constraint_set_t), intent(in), optional :: closed   !! contacts that give way there
      class(sparse_solver_t), allocatable :: mass
      type(csr_t) :: weight
      real(wp), allocatable, dimension(:) :: q, before, image, solved
      real(wp) :: alpha(most_vectors), beta(0:most_vectors), largest, last
      integer :: i, n

      h = huge(h)
      n = system%space%numbering%n_unknown
      if (n == 0) return
      weight = system%matrix
      call terms_mass_values(system%term, weight%value)
      call solver_create(solver_default, matrix_definite, mass)
      call mass%analyse(system%matrix, error)
      if (.not. allocated(error)) call mass%factorise(weight%value, error)
      if (allocated(error)) return
      q = [(sin(real(i, wp)) + merge(0.5_wp, -0.5_wp, mod(i, 3) == 0), i = 1, n)]
      allocate(before(n), solved(n), image(n), source=0.0_wp)
      call csr_multiply(weight, q, image)
      q = q/sqrt(dot_product(q, image))
      beta(0) = 0.0_wp
      last = 0.0_wp
      do i = 1, min(n, most_vectors)
         call stiffness_times(system, place, stiffness, q, image, closed)
         alpha(i) = dot_product(q, image)
         call mass%solve(image, solved, error)
         if (allocated(error)) exit
         solved = solved - alpha(i)*q - beta(i - 1)*before
         call csr_multiply(weight, solved, image)
         beta(i) = sqrt(max(0.0_wp, dot_product(solved, image)))
         largest = tridiagonal_largest(alpha(:i), beta(1:i - 1))
         if (mod(i, overlap_query_every) == 0) then
            if (abs(largest - last) <= settled*abs(largest)) exit
            last = largest
         end if
         if (.not. beta(i) > epsilon(1.0_wp)*(abs(alpha(i)) + beta(i - 1))) exit
         before = q
         q = solved/beta(i)
      end do
      call mass%free()
      if (allocated(error)) return
      if (largest > 0.0_wp) h = 2.0_wp/sqrt(largest)
   end subroutine critical_sharp

   !> K q over the unknowns.
   subroutine stiffness_times(system, place, stiffness, q, image, closed)
      type(system_t), intent(inout) :: system
      type(motion_t), intent(in) :: place
      real(wp), intent(in) :: stiffness(:)       !! (n_node) [M/T^2]
      real(wp), intent(in) :: q(:)               !! (n_unknown)
      real(wp), intent(out), contiguous :: image(:)      !! (n_unknown)
      type(constraint_set_t), intent(in), optional :: closed
      real(wp), dimension(size(place%x, 1), size(place%x, 2)) :: displacement, force
      integer :: i, k

      displacement = 0.0_wp
      call add_to_dofs(system%space%numbering, q, 1.0_wp, displacement)
      call system_tangent_times(system, place, displacement, force)
      do i = 1, size(stiffness)
         force(:, i) = force(:, i) + stiffness(i)*displacement(:, i)
      end do
      if (present(closed)) then
         do k = 1, closed%n
            associate (item => closed%item(k))
               call condition_add_field(item, closed%law(k)%row%stiffest() &
                  *condition_rate(item, displacement), item%c, force)
            end associate
         end do
      end if
      call pick_unknowns(system%space%numbering, force, image)
   end subroutine stiffness_times

   !> The largest eigenvalue of a symmetric tridiagonal matrix, by halving: it is where the last of
   !> the pivots of T - z turns negative.
   pure real(wp) function tridiagonal_largest(diagonal, beside) result(largest)
      real(wp), intent(in) :: diagonal(:)        !! (n)
      real(wp), intent(in) :: beside(:)          !! (n - 1)
      real(wp) :: low, high, middle, pivot, next(0:size(diagonal))
      integer :: i, n
      logical :: is_above

      n = size(diagonal)
      next = 0.0_wp
      next(1:n - 1) = abs(beside)
      low = maxval(diagonal)
      high = maxval(diagonal + next(:n - 1) + next(1:))
      do
         middle = low + 0.5_wp*(high - low)
         if (.not. (middle > low .and. middle < high)) exit
         is_above = .true.
         pivot = diagonal(1) - middle
         do i = 2, n
            is_above = pivot < 0.0_wp
            if (.not. is_above) exit
            pivot = diagonal(i) - middle - beside(i - 1)**2/pivot
         end do
         is_above = is_above .and. pivot < 0.0_wp
         if (is_above) then
            high = middle
         else
            low = middle
         end if
      end do
      largest = high
   end function tridiagonal_largest

end module emcon_critical_step
