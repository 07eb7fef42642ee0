!> Which packs of elements each of several threads takes, and in whose turn forces are summed.
!>
!> Packs are shared out in their order. Nodes whose elements are all in one share get their forces
!> at once; the packs at nodes that shares have in common keep theirs, and these nodes are summed
!> afterwards, again pack by pack. So each sum runs in the order of the packs, and no bit depends on
!> the number of shares.
module emcon_pack_shares
   use emcon_element_pack, only : element_pack_t, pack_response_t
   use emcon_kinds, only : wp
   use emcon_law, only : n_lane
   implicit none
   private
   public :: pack_shares_t, border_pack_t, shares_lay_out, shares_has, border_keep

   !> What a pack gives that has nodes in common with other shares.
   type :: border_pack_t
      integer :: pack = 0                        !! its number
      real(wp), allocatable :: force(:, :, :)        !! (n_lane, n_dim, n_node)
      real(wp), allocatable :: magnitude(:, :, :)    !! (n_lane, n_dim, n_node)
      real(wp), allocatable :: tangent(:, :, :, :, :)   !! by nodes twice; if one was asked for
      real(wp) :: largest(n_lane) = 0.0_wp       !! displacement [L]
   end type border_pack_t

   type :: pack_shares_t
      integer :: n = 0                           !! shares
      integer, allocatable :: first(:)           !! (n + 1) packs before each share
      integer, allocatable :: turn(:)            !! (n_node) 0: at once; else the share that sums it
      integer, allocatable :: place(:)           !! (n_pack) in `border`; 0: not there
      type(border_pack_t), allocatable :: border(:)
      integer, allocatable :: inverted(:)        !! (n) first inverted element of a share; 0: none
   end type pack_shares_t

contains

   !> Share out packs, unless that was done already.
   pure subroutine shares_lay_out(self, pack, n_node, n)
      type(pack_shares_t), intent(inout) :: self
      type(element_pack_t), intent(in) :: pack(:)    !! of all elements
      integer, intent(in) :: n_node              !! of the scene
      integer, intent(in) :: n                   !! shares, > 0
      integer :: k, t
      real(wp) :: done, all_of_them

      if (self%n == n) return
      if (self%n > 0) deallocate(self%first, self%turn, self%place, self%border, self%inverted)
      self%n = n
      allocate(self%first(n + 1), self%inverted(n), self%place(size(pack)), self%turn(n_node), &
         source=0)
      all_of_them = real(sum(pack%n_gp), wp)
      done = 0.0_wp
      t = 1
      do k = 1, size(pack)
         do while (done >= t*all_of_them/n)
            t = t + 1
            self%first(t) = k - 1
         end do
         done = done + pack(k)%n_gp
      end do
      self%first(t + 1:) = size(pack)
      call find_borders(self, pack)
   end subroutine shares_lay_out

   !> The nodes that shares have in common, and the packs that these are nodes of.
   pure subroutine find_borders(self, pack)
      type(pack_shares_t), intent(inout) :: self     !! `first` is set
      type(element_pack_t), intent(in) :: pack(:)
      integer, allocatable :: user(:)            ! the first share of each node
      integer :: b, i, k, l, t

      allocate(user(size(self%turn)), source=0)
      do t = 1, self%n
         do k = self%first(t) + 1, self%first(t + 1)
            do i = 1, pack(k)%n_node
               do l = 1, pack(k)%n
                  associate (node => pack(k)%node(l, i))
                     if (user(node) == 0) user(node) = t
                     if (user(node) /= t) self%turn(node) = t
                  end associate
               end do
            end do
         end do
      end do
      b = 0
      do k = 1, size(pack)
         if (.not. shares_has(self, pack(k), 1, self%n)) cycle
         b = b + 1
         self%place(k) = b
      end do
      allocate(self%border(b))
      do k = 1, size(pack)
         if (self%place(k) == 0) cycle
         associate (border => self%border(self%place(k)), n_dim => pack(k)%n_dim)
            border%pack = k
            allocate(border%force(n_lane, n_dim, pack(k)%n_node), &
               border%magnitude(n_lane, n_dim, pack(k)%n_node), source=0.0_wp)
         end associate
      end do
   end subroutine find_borders

   !> Has the pack nodes whose turn is one of `first` to `last`?
   pure logical function shares_has(self, pack, first, last)
      type(pack_shares_t), intent(in) :: self
      type(element_pack_t), intent(in) :: pack
      integer, intent(in) :: first, last         !! 0..n
      integer :: i, l

      shares_has = .true.
      do i = 1, pack%n_node
         do l = 1, pack%n
            associate (turn => self%turn(pack%node(l, i)))
               if (turn >= first .and. turn <= last) return
            end associate
         end do
      end do
      shares_has = .false.
   end function shares_has

   !> Keep what a pack has given.
   pure subroutine border_keep(self, part, largest, with_tangent)
      type(border_pack_t), intent(inout) :: self
      type(pack_response_t), intent(in) :: part
      real(wp), intent(in) :: largest(n_lane)    !! displacement [L]
      logical, intent(in) :: with_tangent        !! `part` has one

      associate (n => size(self%force, 3))
         self%force = part%force(:, :, :n)
         if (part%with_sizes) self%magnitude = part%magnitude(:, :, :n)
         if (part%with_sizes) self%largest = largest
         if (with_tangent) self%tangent = part%tangent(:, :, :n, :, :n)
      end associate
   end subroutine border_keep

end module emcon_pack_shares
