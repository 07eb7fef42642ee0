!> Which of two surfaces should be the slave: the one whose edges see less of the other's shape.
!>
!> Source: docs/theory.md, section 4.12; docs/verification.md, a slave surface that is too coarse.
module emcon_deck_check_sides
   use emcon_interactions, only : contact_pair_t
   use emcon_kinds, only : wp
   use emcon_mesh, only : surface_t
   use emcon_scene, only : scene_t
   use emcon_surface_edges, only : surface_edges
   use emcon_text, only : to_text
   implicit none
   private
   public :: find_advice

   !> A slave surface longer than this times its master: force leaks where it reaches beyond. The
   !> rest is room for curved surfaces on straight ones.
   real(wp), parameter :: large_ratio = 1.25_wp
   !> Slave edges that see the master turn by more than this angle [degrees], and by this times as
   !> much as the other way round, push along the surface; those this times as long, at corners.
   real(wp), parameter :: coarse_ratio = 1.6_wp, seen_turn = 10.0_wp
   !> Surfaces whose edges see less of each other are flat to them [degrees].
   real(wp), parameter :: flat_turn = 5.0_wp
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

   !> Why the slave of `pair` should be the master, to follow on its name; empty if it should not.
   subroutine find_advice(scene, pair, advice, is_bent)
      type(scene_t), intent(in) :: scene
      type(contact_pair_t), intent(in) :: pair
      character(len=:), allocatable, intent(out) :: advice
      logical, intent(out) :: is_bent            !! because the slave sees its master turn
      type(shape_t) :: slave, master
      real(wp) :: ratio, seen(2)
      integer :: power

      advice = ""
      is_bent = .false.
      if (scene%surface(pair%slave)%is_nodal .or. scene%surface(pair%master)%is_nodal) return
      ! Scaled by a power of two: coordinates may be as large or as small as numbers can be.
      power = -exponent(maxval(abs(scene%x)))
      slave = shape_of(scene, scene%surface(pair%slave), power)
      master = shape_of(scene, scene%surface(pair%master), power)
      if (master%length <= 0.0_wp .or. slave%length <= 0.0_wp) return
      ratio = min(slave%mean/master%mean, slave%shortest/master%shortest)
      seen = [ratio*master%turn, slave%turn/ratio]
      if (seen(2) > max(seen(1), flat_turn)) return
      is_bent = seen(1) > max(seen_turn, coarse_ratio*seen(2))
      associate (name => scene%surface(pair%master)%name)
         if (is_bent) then
            advice = " has edges over which master surface " // name // " turns by " &
               // to_text(seen(1), 3) // " degrees and would push it sideways; the rounder one " &
               // "should be the slave"
         else if (slave%length > large_ratio*master%length) then
            if (coarse_ratio*slave%mean < master%mean) return
            advice = " is " // to_text(slave%length/master%length, 3) // " times as long as " &
               // "master surface " // name // "; the smaller one should be the slave"
         else if (ratio > coarse_ratio) then
            advice = " has edges " // to_text(ratio, 3) // " times as long as those of master " &
               // "surface " // name // " and would push its corners sideways; the finer one " &
               // "should be the slave"
         end if
      end associate
   end subroutine find_advice

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
