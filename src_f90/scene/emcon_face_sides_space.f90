!> The sides of faces in space, and what is wrong with the shape of a face.
module emcon_face_sides_space
   use emcon_kinds, only : dp, wp
   use emcon_rotation, only : cross_product
   use emcon_sort, only : sort_order
   implicit none
   private
   public :: face_fault, face_sides, last_of_side, side_t

   integer, parameter :: n_dim = 3
   !> An area below this part of the square of the circumference is none.
   real(wp), parameter :: least_area = 1.0e-8_wp

   !> A side of a face: its nodes, the lower number first, and whether it runs from that to the
   !> other one.
   type :: side_t
      integer :: low = 0
      integer :: high = 0
      logical :: is_up = .false.
      integer :: facet = 0
   end type side_t

contains

   !> All sides of faces, those of the same nodes next to each other.
   pure subroutine face_sides(facet, side)
      integer, intent(in) :: facet(:, :)         !! (most nodes, n_facet) in turn; 0: no more
      type(side_t), allocatable, intent(out) :: side(:)  !! (n)
      real(dp), allocatable :: key(:)
      real(dp) :: stride
      integer :: f, k, m, n, from, to

      stride = real(maxval(facet) + 1, dp)
      allocate(side(count(facet > 0)), key(count(facet > 0)))
      n = 0
      do f = 1, size(facet, 2)
         m = count(facet(:, f) > 0)
         do k = 1, m
            from = facet(k, f)
            to = facet(1 + mod(k, m), f)
            n = n + 1
            side(n) = side_t(min(from, to), max(from, to), from < to, f)
            key(n) = real(side(n)%low, dp)*stride + real(side(n)%high, dp)
         end do
      end do
      side = side(sort_order(key))
   end subroutine face_sides

   !> The last one of the sides of the same nodes as side `first`.
   pure integer function last_of_side(side, first) result(last)
      type(side_t), intent(in) :: side(:)        !! of `face_sides`
      integer, intent(in) :: first               !! 1 to n

      last = first
      do while (last < size(side))
         if (side(last + 1)%low /= side(first)%low .or. &
            side(last + 1)%high /= side(first)%high) exit
         last = last + 1
      end do
   end function last_of_side

   !> Is a face flat, or are parts of it about its middle turned over?
   pure subroutine face_fault(x, is_flat, is_folded)
      real(wp), intent(in) :: x(:, :)            !! (3, n_node) in turn [L]
      logical, intent(out) :: is_flat, is_folded      !! it has no area; it is turned over
      real(wp) :: at(n_dim, size(x, 2)), part(n_dim, size(x, 2)), round
      integer :: k, m

      m = size(x, 2)
      is_flat = .true.
      is_folded = .false.
      ! Scaled by a power of two: coordinates may be as large or as small as numbers can be.
      at = scale(x, -exponent(maxval(abs(x))))
      associate (middle => sum(at, 2)/real(m, wp))
         do k = 1, m
            at(:, k) = at(:, k) - middle
         end do
      end associate
      if (.not. any(abs(at) > 0.0_wp)) return
      at = at/maxval(abs(at))
      round = 0.0_wp
      do k = 1, m
         associate (here => at(:, k), there => at(:, 1 + mod(k, m)))
            part(:, k) = cross_product(here, there)
            round = round + norm2(there - here)
         end associate
      end do
      associate (normal => sum(part, 2))
         is_flat = norm2(normal) <= least_area*round**2
         is_folded = .not. is_flat .and. any(matmul(normal, part) <= 0.0_wp)
      end associate
   end subroutine face_fault

end module emcon_face_sides_space
