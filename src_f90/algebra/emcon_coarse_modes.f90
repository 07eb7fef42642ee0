! build: streams
!> A coarse space for conjugate gradients: motions that take little energy, group by group.
!>
!> An incomplete factor leaves what a whole body does, as bending, to many steps. Blocks of unknowns
!> are put into groups that hang together, and the motions that were given, each within one group
!> alone, are the columns of Z. With Q = Z (Z^T A Z)^-1 Z^T a solve begins at Q b, and what a
!> preconditioner M^-1 makes of a residual r is completed to
!>
!>    z = M^-1 r + Z (Z^T A Z)^-1 (Z^T r - (A Z)^T M^-1 r)
!>
!> which has the steps of a symmetric definite one, and keeps Z^T r at round-off. What depends on
!> other motions in its group is left out. Groups and sums have one order.
!> Source: J. M. Tang, R. Nabben, C. Vuik, Y. A. Erlangga, J. Sci. Comput. 39 (2009) 340-370,
!> A-DEF2; docs/theory.md, eq. (25e).
module emcon_coarse_modes
   use emcon_kinds, only : dp
   use emcon_lapack, only : dense_cholesky, dense_cholesky_solve
   use emcon_node_blocks, only : n_side, node_blocks_t
   implicit none
   private
   public :: coarse_modes_t, coarse_modes_init, coarse_modes_factorise, coarse_modes_begin, &
      coarse_modes_complete

   !> The coarse solution takes this part of the products of a step, and has so many unknowns at
   !> most; a group has so many blocks at least.
   real(dp), parameter :: most_part = 0.1_dp
   integer, parameter :: most_coarse = 1500, least_blocks = 27
   !> A motion of which less than this part is left depends on others.
   real(dp), parameter :: dependent = 1.0e-6_dp

   type :: coarse_modes_t
      logical :: is_made = .false.               !! there is a factor of Z^T A Z
      integer :: n_group = 0
      integer :: n_mode = 0                      !! columns of Z in each group, some of them zero
      integer, allocatable, private :: group(:)  !! (n_block)
      real(dp), allocatable, private :: basis(:, :, :)   !! (n_side, n_mode, n_block) Z
      integer, allocatable, private :: start(:)  !! (n_block + 1) groups met before each block's
      integer, allocatable, private :: met(:)    !! by a row of A
      real(dp), allocatable, private :: image(:, :, :)   !! (n_side, n_mode, met) A Z
      real(dp), allocatable, private :: l(:, :)  !! factor of Z^T A Z
   end type coarse_modes_t

   !> Which blocks meet which, but for themselves.
   type :: neighbours_t
      integer, allocatable :: start(:)           !! (n_block + 1)
      integer, allocatable :: block(:)
   end type neighbours_t

contains

   !> Lay out groups and Z for matrices of the pattern of `blocks`.
   pure subroutine coarse_modes_init(self, blocks, mode)
      type(coarse_modes_t), intent(out) :: self
      type(node_blocks_t), intent(in) :: blocks
      real(dp), intent(in) :: mode(:, :)         !! (unknowns, >= 1)
      type(neighbours_t) :: near
      integer, allocatable :: order(:), first(:)
      integer :: n_coarse, n_group, g

      self%n_mode = size(mode, 2)
      n_coarse = min(most_coarse, int(sqrt(most_part*4.0_dp*n_side**2*size(blocks%column))))
      n_group = max(1, min(n_coarse/self%n_mode, blocks%n_block/least_blocks))
      call find_neighbours(near, blocks)
      call find_groups(near, (blocks%n_block + n_group - 1)/n_group, order, first)
      self%n_group = size(first) - 1
      allocate(self%group(blocks%n_block))
      do g = 1, self%n_group
         self%group(order(first(g) + 1:first(g + 1))) = g
      end do
      call find_basis(self, blocks, mode, order, first)
      call find_met(self, near)
      allocate(self%image(n_side, self%n_mode, size(self%met)))
      associate (n => self%n_mode*self%n_group)
         allocate(self%l(n, n))
      end associate
   end subroutine coarse_modes_init

   !> From the lower triangle.
   pure subroutine find_neighbours(self, blocks)
      type(neighbours_t), intent(out) :: self
      type(node_blocks_t), intent(in) :: blocks
      integer :: place(blocks%n_block), b, k

      place = 0
      do b = 1, blocks%n_block
         do k = blocks%row_start(b) + 1, blocks%row_start(b + 1) - 1
            place([b, blocks%column(k)]) = place([b, blocks%column(k)]) + 1
         end do
      end do
      allocate(self%start(blocks%n_block + 1), source=0)
      do b = 1, blocks%n_block
         self%start(b + 1) = self%start(b) + place(b)
      end do
      allocate(self%block(self%start(blocks%n_block + 1)))
      place = self%start(:blocks%n_block)
      do b = 1, blocks%n_block
         do k = blocks%row_start(b) + 1, blocks%row_start(b + 1) - 1
            associate (c => blocks%column(k))
               place([b, c]) = place([b, c]) + 1
               self%block(place(b)) = c
               self%block(place(c)) = b
            end associate
         end do
      end do
   end subroutine find_neighbours

   !> Halve what is larger than `most`, across where it is longest, until nothing is.
   pure subroutine find_groups(near, most, order, first)
      type(neighbours_t), intent(in) :: near
      integer, intent(in) :: most                !! blocks of a group
      integer, allocatable, intent(out) :: order(:)      !! (n_block) group by group
      integer, allocatable, intent(out) :: first(:)      !! (n_group + 1) blocks before each
      integer, allocatable :: halves(:), part(:)
      logical, allocatable :: is_new(:)
      integer :: n_block, n, s

      n_block = size(near%start) - 1
      order = [(s, s = 1, n_block)]
      first = [0, n_block]
      allocate(part(n_block), source=1)
      allocate(is_new(n_block), source=.false.)
      do while (maxval(first(2:) - first(:size(first) - 1)) > most)
         allocate(halves(2*size(first)), source=0)
         n = 1
         do s = 1, size(first) - 1
            associate (own => order(first(s) + 1:first(s + 1)))
               if (size(own) > most) then
                  call arrange(near, part, own, is_new)
                  n = n + 1
                  halves(n) = first(s) + size(own)/2
               end if
               n = n + 1
               halves(n) = first(s + 1)
            end associate
         end do
         first = halves(:n)
         deallocate(halves)
         do s = 1, size(first) - 1
            part(order(first(s) + 1:first(s + 1))) = s
         end do
      end do
   end subroutine find_groups

   !> Breadth first from what is reached last.
   pure subroutine arrange(near, part, own, is_new)
      type(neighbours_t), intent(in) :: near
      integer, intent(in) :: part(:)             !! (n_block) that of `own` is theirs alone
      integer, intent(inout) :: own(:)           !! blocks
      logical, intent(inout) :: is_new(:)        !! (n_block) work space, .false.
      integer :: way(size(own)), pass, at, n, next, k, c

      do pass = 1, 2
         is_new(own) = .true.
         n = 0
         at = 0
         next = 0
         do while (n < size(own))
            if (at == n) then                    ! another piece
               next = next + 1
               if (.not. is_new(own(next))) cycle
               call list(own(next), way, n, is_new)
            end if
            at = at + 1
            do k = near%start(way(at)) + 1, near%start(way(at) + 1)
               c = near%block(k)
               if (is_new(c) .and. part(c) == part(way(at))) call list(c, way, n, is_new)
            end do
         end do
         is_new(own) = .false.
         own = way
         if (pass == 1) own = own(size(own):1:-1)
      end do
   end subroutine arrange

   !> The next one on the way is block `b`.
   pure subroutine list(b, way, n, is_new)
      integer, intent(in) :: b
      integer, intent(inout) :: way(:)           !! (>= n) blocks so far
      integer, intent(inout) :: n                !! so many
      logical, intent(inout) :: is_new(:)        !! (n_block)

      n = n + 1
      way(n) = b
      is_new(b) = .false.
   end subroutine list

   !> The motions within each group, orthonormal.
   pure subroutine find_basis(self, blocks, mode, order, first)
      type(coarse_modes_t), intent(inout) :: self
      type(node_blocks_t), intent(in) :: blocks
      real(dp), intent(in) :: mode(:, :)
      integer, intent(in) :: order(:), first(:)  !! as of `find_groups`
      real(dp) :: before
      integer :: g, i, m, other, pass

      allocate(self%basis(n_side, self%n_mode, blocks%n_block), source=0.0_dp)
      do i = 1, blocks%n
         associate (b => (blocks%place(i) - 1)/n_side + 1)
            self%basis(blocks%place(i) - n_side*(b - 1), :, b) = mode(i, :)
         end associate
      end do
      do g = 1, self%n_group
         associate (own => order(first(g) + 1:first(g + 1)))
            do m = 1, self%n_mode
               before = sqrt(product_of(self, own, m, m))
               do pass = 1, 2
                  do other = 1, m - 1
                     self%basis(:, m, own) = self%basis(:, m, own) &
                        - product_of(self, own, other, m)*self%basis(:, other, own)
                  end do
               end do
               associate (left => sqrt(product_of(self, own, m, m)))
                  if (left > dependent*before) then
                     self%basis(:, m, own) = self%basis(:, m, own)/left
                  else
                     self%basis(:, m, own) = 0.0_dp
                  end if
               end associate
            end do
         end associate
      end do
   end subroutine find_basis

   !> The product of two columns of Z in a group.
   pure real(dp) function product_of(self, own, i, j)
      type(coarse_modes_t), intent(in) :: self
      integer, intent(in) :: own(:)              !! blocks of the group
      integer, intent(in) :: i, j                !! columns
      integer :: k

      product_of = 0.0_dp
      do k = 1, size(own)
         product_of = product_of + dot_product(self%basis(:, i, own(k)), self%basis(:, j, own(k)))
      end do
   end function product_of

   !> The groups that the row of each block meets: its own first.
   pure subroutine find_met(self, near)
      type(coarse_modes_t), intent(inout) :: self
      type(neighbours_t), intent(in) :: near
      integer, allocatable :: met(:)
      integer :: b, k, n

      allocate(self%start(size(near%start)), source=0)
      allocate(met(size(near%block) + size(self%group)))
      n = 0
      do b = 1, size(self%group)
         n = n + 1
         met(n) = self%group(b)
         do k = near%start(b) + 1, near%start(b + 1)
            associate (g => self%group(near%block(k)))
               if (any(met(self%start(b) + 1:n) == g)) cycle
               n = n + 1
               met(n) = g
            end associate
         end do
         self%start(b + 1) = n
      end do
      self%met = met(:n)
   end subroutine find_met

   !> A Z and a factor of Z^T A Z for the values of the blocks; `is_made` unless it is not definite.
   subroutine coarse_modes_factorise(self, blocks)
      type(coarse_modes_t), intent(inout) :: self        !! laid out
      type(node_blocks_t), intent(in) :: blocks          !! filled
      integer :: b, c, k, m

      self%image = 0.0_dp
      do b = 1, blocks%n_block
         do k = blocks%row_start(b) + 1, blocks%row_start(b + 1)
            c = blocks%column(k)
            call add_image(self, b, c, blocks%value(:, :, k))
            if (c /= b) call add_image(self, c, b, transpose(blocks%value(:, :, k)))
         end do
      end do
      self%l = 0.0_dp
      do b = 1, blocks%n_block
         do k = self%start(b) + 1, self%start(b + 1)
            associate (row => self%n_mode*(self%group(b) - 1), &
                  column => self%n_mode*(self%met(k) - 1))
               if (row < column) cycle
               do m = 1, self%n_mode
                  self%l(row + 1:row + self%n_mode, column + m) = &
                     self%l(row + 1:row + self%n_mode, column + m) &
                     + matmul(self%image(:, m, k), self%basis(:, :, b))
               end do
            end associate
         end do
      end do
      do m = 1, size(self%l, 1)                  ! columns that were left out
         if (.not. self%l(m, m) > 0.0_dp) self%l(m, m) = 1.0_dp
      end do
      call dense_cholesky(self%l, self%is_made)
   end subroutine coarse_modes_factorise

   !> Add what the motions of block `c` take at block `b`.
   pure subroutine add_image(self, b, c, value)
      type(coarse_modes_t), intent(inout) :: self
      integer, intent(in) :: b, c
      real(dp), intent(in) :: value(n_side, n_side)      !! of A
      integer :: j, k, m

      k = self%start(b) + 1
      do while (self%met(k) /= self%group(c))
         k = k + 1
      end do
      do m = 1, self%n_mode
         do j = 1, n_side
            self%image(:, m, k) = self%image(:, m, k) + value(:, j)*self%basis(j, m, c)
         end do
      end do
   end subroutine add_image

   !> x = Q b, and its energy x.A x: a solution is no smaller.
   subroutine coarse_modes_begin(self, b, x, energy)
      type(coarse_modes_t), intent(in) :: self           !! made
      real(dp), intent(in) :: b(n_side, *)               !! vectors of blocks
      real(dp), intent(out) :: x(n_side, size(self%group))
      real(dp), intent(out) :: energy
      real(dp) :: c(self%n_mode, self%n_group), force(self%n_mode, self%n_group)

      force = 0.0_dp
      call add_forces(self, b, force)
      c = force
      call solve_coarse(self, size(c), c)
      energy = sum(c*force)
      x = 0.0_dp
      call add_motions(self, c, x)
   end subroutine coarse_modes_begin

   !> z = z + Z (Z^T A Z)^-1 (Z^T r - (A Z)^T z)
   subroutine coarse_modes_complete(self, r, z)
      type(coarse_modes_t), intent(in) :: self           !! made
      real(dp), intent(in) :: r(n_side, *)               !! vectors of blocks
      real(dp), intent(inout) :: z(n_side, size(self%group))
      real(dp) :: c(self%n_mode, self%n_group)
      integer :: b, j, k

      c = 0.0_dp
      call add_forces(self, r, c)
      do b = 1, size(self%group)
         do k = self%start(b) + 1, self%start(b + 1)
            do j = 1, n_side
               c(:, self%met(k)) = c(:, self%met(k)) - self%image(j, :, k)*z(j, b)
            end do
         end do
      end do
      call solve_coarse(self, size(c), c)
      call add_motions(self, c, z)
   end subroutine coarse_modes_complete

   !> c = c + Z^T r
   pure subroutine add_forces(self, r, c)
      type(coarse_modes_t), intent(in) :: self
      real(dp), intent(in) :: r(n_side, *)
      real(dp), intent(inout) :: c(:, :)                 !! (n_mode, n_group)
      integer :: b, j

      do b = 1, size(self%group)
         do j = 1, n_side
            c(:, self%group(b)) = c(:, self%group(b)) + self%basis(j, :, b)*r(j, b)
         end do
      end do
   end subroutine add_forces

   !> x = x + Z c
   pure subroutine add_motions(self, c, x)
      type(coarse_modes_t), intent(in) :: self
      real(dp), intent(in) :: c(:, :)                    !! (n_mode, n_group)
      real(dp), intent(inout) :: x(n_side, *)
      integer :: b, m

      do b = 1, size(self%group)
         do m = 1, self%n_mode
            x(:, b) = x(:, b) + self%basis(:, m, b)*c(m, self%group(b))
         end do
      end do
   end subroutine add_motions

   !> c = (Z^T A Z)^-1 c
   subroutine solve_coarse(self, n, c)
      type(coarse_modes_t), intent(in) :: self
      integer, intent(in) :: n
      real(dp), intent(inout) :: c(n)

      call dense_cholesky_solve(self%l, c)
   end subroutine solve_coarse

end module emcon_coarse_modes
