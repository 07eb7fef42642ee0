!> Which of two surfaces should be the slave: the smaller one, and the one that shows its shape.
!>
!> Source: docs/verification.md, a slave surface that is too coarse.
module emcon_deck_check_sides
   use emcon_deck_reader, only : reader_t
   use emcon_diagnostics, only : add_warning
   use emcon_kinds, only : wp
   use emcon_scene, only : contact_pair_t, scene_t, surface_t
   use emcon_surface_edges, only : surface_edges
   use emcon_text, only : to_text
   implicit none
   private
   public :: check_sides

   !> A slave surface longer than this times its master gives a warning: force leaks where it
   !> reaches beyond. The rest is room for curved surfaces on straight ones.
   real(wp), parameter :: large_ratio = 1.25_wp
   !> Slave edges longer than this times those of the master, or that see it turn by more than this
   !> angle, give one: they push along the surface.
   real(wp), parameter :: coarse_ratio = 1.6_wp, seen_turn = 20.0_wp
   !> Where a surface turns by more, it has a corner [degrees].
   real(wp), parameter :: corner = 60.0_wp

   !> Size and shape of a surface in the reference configuration; lengths times a power of two.
   type :: shape_t
      real(wp) :: length = 0.0_wp
      real(wp) :: mean = 0.0_wp                  !! edge
      real(wp) :: shortest = huge(1.0_wp)        !! edge
      real(wp) :: turn = 0.0_wp                  !! largest at a node that is no corner [degrees]
   end type shape_t

contains

   !> Warn of a slave surface that should be the master.
   subroutine check_sides(reader, scene, pair)
      type(reader_t), intent(inout) :: reader
      type(scene_t), intent(in) :: scene
      type(contact_pair_t), intent(in) :: pair
      type(shape_t) :: slave, master
      real(wp) :: ratio
      integer :: power

      if (reader%doubt_positions) return
      if (scene%surface(pair%slave)%is_nodal .or. scene%surface(pair%master)%is_nodal) return
      ! Scaled by a power of two: coordinates may be as large or as small as numbers can be.
      power = -exponent(maxval(abs(scene%x)))
      slave = shape_of(scene, scene%surface(pair%slave), power)
      master = shape_of(scene, scene%surface(pair%master), power)
      if (master%length <= 0.0_wp .or. slave%length <= 0.0_wp) return
      ratio = min(slave%mean/master%mean, slave%shortest/master%shortest)
      if (slave%length > large_ratio*master%length) then
         if (coarse_ratio*slave%mean < master%mean) return
         call warn(" is " // to_text(slave%length/master%length, 3) // " times as long as " &
            // "master surface " // scene%surface(pair%master)%name // "; the smaller one should " &
            // "be the slave: swap the two")
      else if (pair%both_sides) then
         return
      else if (ratio > coarse_ratio) then
         call warn(" has edges " // to_text(ratio, 3) // " times as long as those of master " &
            // "surface " // scene%surface(pair%master)%name // " and would push it sideways; " &
            // "the finer one should be the slave: swap the two")
      else if (ratio*master%turn > seen_turn .and. ratio*slave%turn < seen_turn) then
         call warn(" has edges over which master surface " // scene%surface(pair%master)%name &
            // " turns by " // to_text(ratio*master%turn, 3) // " degrees and would push it " &
            // "sideways; the rounder one should be the slave: swap the two")
      end if

   contains

      subroutine warn(what)
         character(len=*), intent(in) :: what

         call add_warning(reader%log, pair%origin, "*CONTACT PAIR: slave surface " &
            // scene%surface(pair%slave)%name // what)
      end subroutine warn

   end subroutine check_sides

   !> The shape of `surface`, lengths times 2**`power`.
   pure function shape_of(scene, surface, power) result(shape)
      type(scene_t), intent(in) :: scene
      type(surface_t), intent(in) :: surface
      integer, intent(in) :: power
      type(shape_t) :: shape
      integer, allocatable :: edge(:, :), from(:)
      real(wp), allocatable :: way(:, :)
      integer :: i, n

      call surface_edges(scene, surface, edge)
      allocate(way(2, size(edge, 2)), source=0.0_wp)
      allocate(from(size(scene%x, 2)), source=0)
      n = 0
      do i = 1, size(edge, 2)
         if (any(edge(:, i) == 0)) cycle
         way(:, i) = scale(scene%x(:, edge(2, i)), power) - scale(scene%x(:, edge(1, i)), power)
         from(edge(1, i)) = i
         associate (length => norm2(way(:, i)))
            if (.not. length > 0.0_wp) cycle
            n = n + 1
            shape%length = shape%length + length
            shape%shortest = min(shape%shortest, length)
         end associate
      end do
      if (n == 0) return
      shape%mean = shape%length/n
      do i = 1, size(edge, 2)
         if (any(edge(:, i) == 0)) cycle
         if (from(edge(2, i)) == 0) cycle
         associate (turn => turn_of(way(:, i), way(:, from(edge(2, i)))))
            if (turn <= corner) shape%turn = max(shape%turn, turn)
         end associate
      end do
   end function shape_of

   !> The angle between two directions [degrees].
   pure real(wp) function turn_of(a, b)
      real(wp), intent(in) :: a(2), b(2)
      real(wp), parameter :: degree = acos(-1.0_wp)/180.0_wp

      turn_of = atan2(abs(a(1)*b(2) - a(2)*b(1)), dot_product(a, b))/degree
   end function turn_of

end module emcon_deck_check_sides
