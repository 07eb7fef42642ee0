!> How two edges in space lie to each other and to the faces beside them: what tells whether they
!> may meet, before where they cross is found. Source: docs/theory.md, section 14, after eq. (51).
module emcon_edge_sight_space
   use emcon_edge_pair_space, only : crossing_t, n_edge_pair_node
   use emcon_kinds, only : wp
   use emcon_rotation, only : cross_product
   implicit none
   private
   public :: begins_beyond, is_at_end, is_outside, is_past_ends, is_within
   public :: length_of, look_between, normal_of, unit

   !> An edge holds what comes from between its faces, and from so much outside: the sine of that
   !> angle by the sine of that between the faces. Edges that lie on faces would be on the limit.
   real(wp), parameter :: beside = 0.25_wp
   !> So far inside its ends, by its length, an edge begins to hold, as nodes hold there.
   real(wp), parameter :: begins_beyond = -1.0e-3_wp

contains

   !> Do edges cross past their ends by more than `reach`? Of parallel ones it is not told.
   pure logical function is_past_ends(at, length, reach)
      real(wp), intent(in) :: at(3, n_edge_pair_node)        !! [L]
      real(wp), intent(in) :: length(2)          !! of the edges [L]
      real(wp), intent(in) :: reach              !! [L]
      real(wp) :: a(3), b(3), d(3), ab, determinant, place(2)

      a = at(:, 2) - at(:, 1)
      b = at(:, 4) - at(:, 3)
      d = at(:, 3) - at(:, 1)
      ab = dot_product(a, b)
      determinant = (length(1)*length(2))**2 - ab**2
      place(1) = dot_product(d, a)*length(2)**2 - dot_product(d, b)*ab
      place(2) = dot_product(d, a)*ab - dot_product(d, b)*length(1)**2
      is_past_ends = any(max(-place, place - determinant)*length > reach*determinant)
   end function is_past_ends

   !> Does a direction that is `within` the normals at an edge, which turns by `turn`, count as one
   !> that is not between them, `least` being the least turn that holds?
   pure logical function is_outside(within, turn, least)
      real(wp), intent(in) :: within             !! as `look_between` has it
      real(wp), intent(in) :: turn               !! the same
      real(wp), intent(in) :: least              !! sine of a turn; < 0: as hollow

      is_outside = turn <= least .or. within <= min(least, 0.0_wp) - beside*abs(turn)
   end function is_outside

   !> How far within the outward normals of the faces at an edge a direction normal to it is: the
   !> sine of the angle from the nearer one, < 0 outside; and that of the turn between the faces.
   pure subroutine look_between(direction, normal, along, within, turn)
      real(wp), intent(in) :: direction(3)       !! of unit length
      real(wp), intent(in) :: normal(3, 2)       !! of unit length
      real(wp), intent(in) :: along(3)           !! the edge, as its first face runs [L]
      real(wp), intent(out) :: within            !! sine
      real(wp), intent(out) :: turn              !! sine, > 0: outwards

      associate (axis => unit(along))
         turn = dot_product(cross_product(normal(:, 1), normal(:, 2)), axis)
         within = min(dot_product(cross_product(normal(:, 1), direction), axis), &
            dot_product(cross_product(direction, normal(:, 2)), axis))
      end associate
      if (.not. dot_product(direction, sum(normal, 2)) > 0.0_wp) within = -1.0_wp
   end subroutine look_between

   !> Do edges cross within their ends, and `beyond` of their lengths past them?
   pure logical function is_within(crossing, beyond)
      type(crossing_t), intent(in) :: crossing
      real(wp), intent(in) :: beyond             !! of their lengths

      is_within = crossing%sine > 0.0_wp .and. all(crossing%place > -beyond .and. &
         crossing%place < 1.0_wp + beyond)
   end function is_within

   !> Does an edge cross the other one at its last end, or hardly beside it?
   pure logical function is_at_end(crossing)
      type(crossing_t), intent(in) :: crossing

      associate (place => crossing%place)
         is_at_end = crossing%sine > 0.0_wp .and. abs(place(2) - 1.0_wp) <= -begins_beyond .and. &
            place(1) > -begins_beyond .and. place(1) < 1.0_wp + begins_beyond
      end associate
   end function is_at_end

   !> Normal to both edges, of any length.
   pure function normal_of(at) result(normal)
      real(wp), intent(in) :: at(3, n_edge_pair_node)        !! [L]
      real(wp) :: normal(3)

      normal = cross_product(at(:, 2) - at(:, 1), at(:, 4) - at(:, 3))
   end function normal_of

   pure function unit(vector)
      real(wp), intent(in) :: vector(3)          !! any unit
      real(wp) :: unit(3)

      unit = vector/max(sqrt(dot_product(vector, vector)), tiny(vector))
   end function unit

   pure real(wp) function length_of(from, to) result(length)
      real(wp), intent(in) :: from(3)            !! [L]
      real(wp), intent(in) :: to(3)              !! [L]

      length = sqrt(dot_product(to - from, to - from))
   end function length_of

end module emcon_edge_sight_space
