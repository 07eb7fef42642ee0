! build: elements
!> The triangles of the master that are near a slave point: the nearest one that a frame is to see,
!> and what hangs together with it. Source: docs/theory.md, section 14.
module emcon_patch_near_space
   use emcon_kinds, only : wp
   use emcon_nearest_space, only : nearest_t, nearest_update
   use emcon_patch_sides_space, only : frame_normal, frame_sides, patch_sides_t, sides_place
   use emcon_rotation, only : cross_product
   use emcon_sort, only : find_sorted
   use emcon_touch_rule_space, only : touch_rule_space_depth, touch_rule_space_is_beyond, &
      touch_rule_space_is_through
   implicit none
   private
   public :: patch_scope_t, patch_near_t, patch_near_find, patch_near_nearest, patch_near_list, &
      patch_near_goes_on, patch_near_pass, patch_outline_t, patch_outline, patch_outline_misses

   !> A triangle faces a frame if the cosine of their normals is below this.
   real(wp), parameter :: facing = -0.25_wp
   !> How steep that is along the frame.
   real(wp), parameter :: steepest = sqrt(1.0_wp - facing**2)/(-facing)
   !> Triangles at distances that differ by less than this, per facet, are as near.
   real(wp), parameter :: as_near = 1.0e-6_wp
   !> What is behind a triangle by more than this, per facet, is in front of another one.
   real(wp), parameter, public :: room_behind = 0.2_wp
   !> The same where another frame of the node faces that one, or the node is past the end of the
   !> surface: there it is beside the body, not inside of it.
   real(wp), parameter, public :: room_beside = 0.02_wp
   !> Beside triangles of slave facets a surface that ends fades over this part of a facet.
   real(wp), parameter, public :: narrow_flange = 0.05_wp

   !> Facets of the master that a patch may look at.
   type :: patch_scope_t
      integer, allocatable :: facet(:)           !! ascending
      logical, allocatable :: is_far(:)          !! (as `facet`) they tell where lists end, and are
                                                 !! not seen; not allocated: none of them
      real(wp) :: beside = huge(1.0_wp)          !! a triangle of the slave sees what is beside it
                                                 !! by no more [L]
      logical :: gives_way = .false.             !! points may be inside of a surface, and store
                                                 !! energy by that: what they are behind stays
   end type patch_scope_t

   !> A triangle of the slave as it sees what is beside it.
   type :: patch_outline_t
      real(wp) :: out(3, 3) = 0.0_wp             !! (:, k) outwards from side k, of length 1
      real(wp) :: at(3) = 0.0_wp                 !! where its sides are along these [L]
   end type patch_outline_t

   !> Triangles that are near, seen from the contact point.
   type :: patch_near_t
      integer :: n = 0
      integer :: point = 0                       !! of the slave, that looks
      logical :: gives_way = .false.             !! as its scope does
      real(wp) :: along(3) = 0.0_wp              !! normal of its frame, of which the list is
      integer, allocatable :: triangle(:)        !! (n) ascending
      integer, allocatable :: beyond(:, :)       !! (3, n) beyond each side, of these; 0: none
      real(wp), allocatable :: corner(:, :, :)   !! (3, 3, n) from the contact point [L]
      real(wp), allocatable :: normal(:, :)      !! (3, n) outwards, of length 1
      real(wp), allocatable :: distance(:)       !! (n) [L]
      logical, allocatable :: is_listed(:)       !! (n) the patch looks at it
      logical, allocatable :: is_apart(:)        !! (n) it is of another layer than the nearest,
                                                 !! or fades where it meets that
      logical, allocatable :: is_past(:)         !! (n) the point is past an end of it, and lower
      logical, allocatable :: is_beside(:)       !! (n) so far off that the patch cannot see it
   end type patch_near_t

contains

   !> Where the triangles of facets are, from contact point `i` of the slave. Those that it is on
   !> the other side of face nothing, nor do planes of symmetry that it rests along the axis of.
   pure subroutine patch_near_find(near, sides, i, scope, x, u)
      type(patch_near_t), intent(out) :: near
      type(patch_sides_t), intent(in) :: sides
      integer, intent(in) :: i                   !! 1 to the number of contact points
      type(patch_scope_t), intent(in) :: scope   !! the facets
      real(wp), intent(in), contiguous :: x(:, :), u(:, :)   !! (3, n_node) [L]
      type(nearest_t) :: nearest
      logical, allocatable :: is_through(:)      ! what it is on the other side of
      real(wp) :: origin(3), own(3)
      integer :: k, t

      near%point = i
      near%gives_way = scope%gives_way
      origin = point_origin(sides, i, x, u)
      associate (start => sides%triangles%split%start, f => scope%facet)
         near%triangle = [((t, t = start(f(k)), start(f(k) + 1) - 1), k = 1, size(f))]
      end associate
      near%n = size(near%triangle)
      call find_beyond(near, sides, scope%facet)
      allocate(near%corner(3, 3, near%n), near%normal(3, near%n), near%distance(near%n))
      allocate(near%is_listed(near%n), near%is_apart(near%n), near%is_past(near%n), &
         near%is_beside(near%n), is_through(near%n), source=.false.)
      if (allocated(scope%is_far)) then
         associate (start => sides%triangles%split%start, f => scope%facet)
            near%is_beside = [((scope%is_far(k), t = start(f(k)), start(f(k) + 1) - 1), &
               k = 1, size(f))]
         end associate
      end if
      own = 0.0_wp
      if (sides%frames%of_triangles .and. sides%rule%is_self) own = frame_normal(sides%frames, i, &
         sides%frames%base(i), x, u)
      do t = 1, near%n
         do k = 1, 3
            near%corner(:, k, t) = sides_place(sides, sides%triangles%split%corner(k, &
               near%triangle(t)), sides%frames%base(i), x, u) - origin
         end do
         associate (c => near%corner(:, :, t), n => near%normal(:, t))
            n = cross_product(c(:, 2) - c(:, 1), c(:, 3) - c(:, 1))
            call nearest_update(nearest, t, [0.0_wp, 0.0_wp, 0.0_wp], c)
            near%distance(t) = sqrt(nearest%square)
            if (dot_product(n, n) > 0.0_wp) n = n/sqrt(dot_product(n, n))
            if (is_mirror(sides, i, near%triangle(t))) n = 0.0_wp
            associate (f => sides%triangles%split%facet(near%triangle(t)), &
                  way => c(:, 1)*nearest%weight(1) + c(:, 2)*nearest%weight(2) &
                  + c(:, 3)*nearest%weight(3))
               is_through(t) = touch_rule_space_is_through(sides%rule, i, f, n, -way, &
                  near%gives_way) .or. touch_rule_space_is_beyond(sides%rule, i, f, own, way)
            end associate
            nearest = nearest_t()
         end associate
      end do
      if (any(is_through)) call leave_far_side(near, sides, is_through)
      if (sides%frames%of_triangles) call find_beside(near, patch_outline(sides, i, x, u), &
         origin, scope%beside + narrow_flange*sides%triangles%size(near%triangle))
   end subroutine patch_near_find

   !> Triangles that the point is on the other side of face nothing. What goes on from them without
   !> a ridge, and is as far in front of it, is the same side of the body: of a thin one the way to
   !> that is slanted.
   pure subroutine leave_far_side(near, sides, is_through)
      type(patch_near_t), intent(inout) :: near  !! with normals
      type(patch_sides_t), intent(in) :: sides
      logical, intent(inout) :: is_through(:)    !! (n) in: those below which it is
      integer :: waiting(near%n), k, n, other, t

      n = count(is_through)
      waiting(:n) = pack([(t, t = 1, near%n)], is_through)
      do while (n > 0)
         t = waiting(n)
         n = n - 1
         do k = 1, 3
            other = near%beyond(k, t)
            if (other == 0) cycle
            if (is_through(other) .or. sides%triangles%is_ridge(k, near%triangle(t))) cycle
            associate (depth => touch_rule_space_depth(sides%rule, near%point, &
                  sides%triangles%split%facet(near%triangle(other)), near%gives_way))
               if (dot_product(near%corner(:, 1, other), near%normal(:, other)) <= depth) cycle
            end associate
            is_through(other) = .true.
            n = n + 1
            waiting(n) = other
         end do
      end do
      do t = 1, near%n
         if (is_through(t)) near%normal(:, t) = 0.0_wp
      end do
   end subroutine leave_far_side

   !> Which of the triangles are beyond each side of each.
   pure subroutine find_beyond(near, sides, facet)
      type(patch_near_t), intent(inout) :: near  !! with its triangles
      type(patch_sides_t), intent(in) :: sides
      integer, intent(in) :: facet(:)            !! ascending, of which all triangles are
      integer :: before(size(facet)), i, k, m, n, side, t

      allocate(near%beyond(3, near%n))
      n = 0
      do i = 1, size(facet)
         before(i) = n
         n = n + sides%triangles%split%start(facet(i) + 1) - sides%triangles%split%start(facet(i))
      end do
      n = 0
      do i = 1, size(facet)
         do m = 1, sides%triangles%split%start(facet(i) + 1) - sides%triangles%split%start(facet(i))
            n = n + 1
            do side = 1, 3
               t = sides%triangles%beyond(side, near%triangle(n))
               near%beyond(side, n) = 0
               if (t == 0) cycle
               associate (f => sides%triangles%split%facet(t))
                  k = i
                  if (f /= facet(i)) k = find_sorted(facet, f)
                  if (k > 0) near%beyond(side, n) = before(k) + 1 + t &
                     - sides%triangles%split%start(f)
               end associate
            end do
         end do
      end do
   end subroutine find_beyond

   !> Find what is beside a triangle of the slave.
   pure subroutine find_beside(near, outline, origin, beside)
      type(patch_near_t), intent(inout) :: near
      type(patch_outline_t), intent(in) :: outline   !! of it
      real(wp), intent(in) :: origin(3)          !! its contact point, from its base [L]
      real(wp), intent(in) :: beside(:)          !! (n) by more [L]
      type(patch_outline_t) :: own
      integer :: t

      own = patch_outline_t(outline%out, outline%at - matmul(origin, outline%out))
      do t = 1, near%n
         if (.not. near%is_beside(t)) near%is_beside(t) = patch_outline_misses(own, &
            near%corner(:, :, t), beside(t))
      end do
   end subroutine find_beside

   !> The outline of slave triangle `i`, from its base.
   pure type(patch_outline_t) function patch_outline(sides, i, x, u) result(outline)
      type(patch_sides_t), intent(in) :: sides
      integer, intent(in) :: i                   !! 1 to the number of triangles
      real(wp), intent(in), contiguous :: x(:, :), u(:, :)   !! (3, n_node) [L]
      real(wp) :: corner(3, 3), normal(3)
      integer :: k

      corner(:, 1) = 0.0_wp
      corner(:, 2:) = frame_sides(sides%frames, i, sides%frames%base(i), x, u)
      normal = cross_product(corner(:, 2), corner(:, 3))
      do k = 1, 3
         associate (out => outline%out(:, k))
            out = cross_product(corner(:, 1 + mod(k, 3)) - corner(:, k), normal)
            out = out/max(sqrt(dot_product(out, out)), tiny(out))
            outline%at(k) = dot_product(out, corner(:, k))
         end associate
      end do
   end function patch_outline

   !> Is all of a facet beside an outline by more than `beside`, as one of its sides shows?
   pure logical function patch_outline_misses(outline, corner, beside) result(misses)
      type(patch_outline_t), intent(in) :: outline
      real(wp), intent(in) :: corner(:, :)       !! (3, any) from its base [L]
      real(wp), intent(in) :: beside             !! [L]
      integer :: j, k

      sides: do k = 1, 3
         misses = .true.
         do j = 1, size(corner, 2)
            misses = dot_product(outline%out(:, k), corner(:, j)) > outline%at(k) + beside
            if (.not. misses) cycle sides
         end do
         return
      end do sides
      misses = .false.
   end function patch_outline_misses

   !> Contact point `i` of the slave, from its base.
   pure function point_origin(sides, i, x, u) result(origin)
      type(patch_sides_t), intent(in) :: sides
      integer, intent(in) :: i
      real(wp), intent(in), contiguous :: x(:, :), u(:, :)
      real(wp) :: origin(3)
      integer :: k

      origin = 0.0_wp
      associate (frames => sides%frames, base => sides%frames%base(i))
         if (i <= frames%n_node .or. frames%start(i + 1) == frames%start(i)) return
         do k = frames%ring_start(frames%start(i)), frames%ring_start(frames%start(i) + 1) - 1
            associate (other => frames%ring(k))
               origin = origin + frames%weight(3, k)*((x(:, other) - x(:, base)) &
                  + (u(:, other) - u(:, base)))
            end associate
         end do
      end associate
   end function point_origin

   !> The nearest triangle that faces a frame more than any other frame of its node; of those as
   !> near the one that faces it most. 0: there is none.
   pure integer function patch_near_nearest(near, sides, frame, x, u) result(nearest)
      type(patch_near_t), intent(in) :: near
      type(patch_sides_t), intent(in) :: sides
      integer, intent(in) :: frame               !! 1 to the number of all frames
      real(wp), intent(in), contiguous :: x(:, :), u(:, :)   !! (3, n_node) [L]
      real(wp) :: best, least, shortest, elsewhere
      integer :: g, t

      nearest = 0
      best = 0.0_wp
      least = huge(least)
      shortest = minval(near%distance)
      associate (i => sides%frames%point(frame))
         associate (first => sides%frames%start(i), last => sides%frames%start(i + 1) - 1)
            associate (cosine => matmul(transpose(near%normal), reshape([(frame_normal( &
                  sides%frames, g, sides%frames%base(i), x, u), g = first, last)], &
                  [3, last - first + 1])))
               elsewhere = minval(near%distance, minloc(cosine, 2) /= frame - first + 1 .and. &
                  minval(cosine, 2) < facing)
               do t = 1, near%n
                  if (minloc(cosine(t, :), 1) /= frame - first + 1) cycle
                  associate (own => cosine(t, frame - first + 1), &
                        room => as_near*sides%triangles%size(near%triangle(t)))
                     if (own >= facing) cycle
                     if (is_hidden(t, min(sides%frames%size(i), &
                        sides%triangles%size(near%triangle(t))))) cycle
                     if (near%distance(t) > least + room) cycle
                     if (near%distance(t) > least - room .and. own >= best - as_near) cycle
                     least = near%distance(t)
                     best = own
                     nearest = t
                  end associate
               end do
            end associate
         end associate
      end associate

   contains

      !> Is the node behind a triangle, but nearer to another by more than `room`? Then that is in
      !> front of it. Of one that another frame of the node faces less is enough.
      pure logical function is_hidden(t, size_of)
         integer, intent(in) :: t
         real(wp), intent(in) :: size_of         !! of the shorter facet of both sides [L]

         is_hidden = near%is_past(t)
         if (is_hidden) return
         is_hidden = dot_product(near%corner(:, 1, t), near%normal(:, t)) > 0.0_wp .and. &
            (near%distance(t) > shortest + room_behind*size_of .or. &
            (near%distance(t) > elsewhere + room_beside*size_of .and. .not. near%gives_way))
      end function is_hidden

   end function patch_near_nearest

   !> Is a node beside what is listed: behind the nearest triangle, and past an end of the surface
   !> by more than that? There it is in front of another side of the body, and what the list shows
   !> of the surface beyond its end is not there. What is listed is then marked as such.
   pure subroutine patch_near_pass(near, sides, nearest, x, u, is_past)
      type(patch_near_t), intent(inout) :: near  !! with its list
      type(patch_sides_t), intent(in) :: sides
      integer, intent(in) :: nearest             !! 1 to near%n
      real(wp), intent(in), contiguous :: x(:, :), u(:, :)   !! (3, n_node) [L]
      logical, intent(out) :: is_past            !! it is
      real(wp) :: depth, size_of
      integer :: t

      is_past = .false.
      if (sides%frames%of_triangles .or. near%gives_way) return
      size_of = sides%triangles%size(near%triangle(nearest))
      depth = dot_product(near%corner(:, 1, nearest), near%normal(:, nearest))
      if (depth <= room_beside*min(size_of, sides%frames%size(near%point))) return
      if (near%distance(nearest)**2 <= 2.0_wp*depth**2) return
      do t = 1, near%n
         if (.not. near%is_listed(t)) cycle
         if (near%distance(t) > near%distance(nearest) + as_near*size_of) cycle
         is_past = ends_there(near, sides, t, x, u)
         if (is_past) exit
      end do
      if (is_past) near%is_past = near%is_past .or. near%is_listed
   end subroutine patch_near_pass

   !> Is the place of a triangle that is nearest to the contact point on a sharp side at which the
   !> list ends?
   pure logical function ends_there(near, sides, t, x, u)
      type(patch_near_t), intent(in) :: near
      type(patch_sides_t), intent(in) :: sides
      integer, intent(in) :: t                   !! 1 to near%n
      real(wp), intent(in), contiguous :: x(:, :), u(:, :)   !! (3, n_node) [L]
      type(nearest_t) :: nearest
      integer :: k

      ends_there = .false.
      call nearest_update(nearest, t, [0.0_wp, 0.0_wp, 0.0_wp], near%corner(:, :, t))
      do k = 1, 3
         ! The corner that is not at side k.
         if (nearest%weight(1 + mod(k + 1, 3)) > 0.0_wp) cycle
         if (.not. sides%triangles%is_ridge(k, near%triangle(t))) cycle
         ends_there = .not. patch_near_goes_on(near, sides, sides%triangles%beyond(k, &
            near%triangle(t)), x, u)
         if (ends_there) return
      end do
   end function ends_there

   !> Find what is of another layer than the nearest triangle. What faces `normal` rises by no more
   !> than its slope allows over the way between them; what rises by more hangs together with the
   !> nearest one around a hole or a step, and may be over it or below.
   pure subroutine find_layer(sides, near, nearest, normal)
      type(patch_sides_t), intent(in) :: sides
      type(patch_near_t), intent(inout) :: near
      integer, intent(in) :: nearest
      real(wp), intent(in) :: normal(3)
      real(wp) :: way, height, own_way, own_height
      integer :: t

      call look_along(normal, near%corner(:, :, nearest), own_way, own_height)
      do t = 1, near%n
         ! What does not face it may be seen edge on.
         if (dot_product(near%normal(:, t), normal) >= facing) cycle
         call look_along(normal, near%corner(:, :, t), way, height)
         near%is_apart(t) = abs(height - own_height) > steepest*(way + own_way) &
            + as_near*sides%triangles%size(near%triangle(nearest))
      end do
   end subroutine find_layer

   !> How far beside the line of sight from 0 a triangle is, and how far ahead there.
   pure subroutine look_along(normal, corner, way, height)
      real(wp), intent(in) :: normal(3), corner(3, 3)
      real(wp), intent(out) :: way, height       !! [L]
      type(nearest_t) :: nearest
      real(wp) :: ahead(3), flat(3, 3)
      integer :: k

      do k = 1, 3
         ahead(k) = dot_product(normal, corner(:, k))
         flat(:, k) = corner(:, k) - normal*ahead(k)
      end do
      call nearest_update(nearest, 1, [0.0_wp, 0.0_wp, 0.0_wp], flat)
      way = sqrt(nearest%square)
      height = dot_product(nearest%weight, ahead)
   end subroutine look_along

   !> List what faces `normal` and hangs together with the nearest triangle. What lies beyond a
   !> ridge and fades right there is left out: the field on this side of it would fade as well.
   pure subroutine patch_near_list(near, sides, nearest, normal, x, u)
      type(patch_near_t), intent(inout) :: near
      type(patch_sides_t), intent(in) :: sides
      integer, intent(in) :: nearest             !! 1 to near%n
      real(wp), intent(in) :: normal(3)          !! of the frame, of length 1
      real(wp), intent(in), contiguous :: x(:, :), u(:, :)   !! (3, n_node) [L]
      integer :: part(near%n)
      logical :: fades(near%n)

      near%along = normal
      call find_layer(sides, near, nearest, normal)
      do
         call spread_list(near, nearest)
         call find_parts(near, sides, part)
         if (maxval(part) <= 1) exit
         call find_fading(near, sides, part, x, u, fades)
         fades = fades .and. part /= part(nearest)
         if (.not. any(fades)) exit
         near%is_apart = near%is_apart .or. fades
      end do
   end subroutine patch_near_list

   !> From the nearest triangle to those beyond its sides, and so on.
   pure subroutine spread_list(near, nearest)
      type(patch_near_t), intent(inout) :: near
      integer, intent(in) :: nearest
      integer :: waiting(near%n), k, n, other, t

      near%is_listed = .false.
      near%is_listed(nearest) = .true.
      waiting(1) = nearest
      n = 1
      do while (n > 0)
         t = waiting(n)
         n = n - 1
         do k = 1, 3
            other = near%beyond(k, t)
            if (other == 0) cycle
            if (near%is_listed(other) .or. near%is_apart(other)) cycle
            if (dot_product(near%normal(:, other), near%along) >= facing) cycle
            near%is_listed(other) = .true.
            n = n + 1
            waiting(n) = other
         end do
      end do
   end subroutine spread_list

   !> Number the parts of the list that hang together without a ridge; 0: not listed.
   pure subroutine find_parts(near, sides, part)
      type(patch_near_t), intent(in) :: near
      type(patch_sides_t), intent(in) :: sides
      integer, intent(out) :: part(:)            !! (n)
      integer :: waiting(near%n), first, k, n, n_part, other, t

      part = 0
      n_part = 0
      do first = 1, near%n
         if (.not. near%is_listed(first) .or. part(first) > 0) cycle
         n_part = n_part + 1
         part(first) = n_part
         waiting(1) = first
         n = 1
         do while (n > 0)
            t = waiting(n)
            n = n - 1
            do k = 1, 3
               if (sides%triangles%is_ridge(k, near%triangle(t))) cycle
               other = near%beyond(k, t)
               if (other == 0) cycle
               if (.not. near%is_listed(other) .or. part(other) > 0) cycle
               part(other) = n_part
               n = n + 1
               waiting(n) = other
            end do
         end do
      end do
   end subroutine find_parts

   !> Which triangles are of a part that ends, without a ridge, at a point that it shares with
   !> another part.
   pure subroutine find_fading(near, sides, part, x, u, fades)
      type(patch_near_t), intent(in) :: near
      type(patch_sides_t), intent(in) :: sides
      integer, intent(in) :: part(:)             !! (n)
      real(wp), intent(in), contiguous :: x(:, :), u(:, :)
      logical, intent(out) :: fades(:)           !! (n)
      integer :: k, t

      fades = .false.
      do t = 1, near%n
         if (part(t) == 0) cycle
         if (fades(t)) cycle
         do k = 1, 3
            associate (triangle => near%triangle(t))
               if (sides%triangles%is_ridge(k, triangle)) cycle
               if (patch_near_goes_on(near, sides, sides%triangles%beyond(k, triangle), x, &
                  u)) cycle
               associate (corner => sides%triangles%split%corner(:, triangle))
                  if (is_shared(corner(k)) .or. is_shared(corner(1 + mod(k, 3)))) then
                     where (part == part(t)) fades = .true.
                  end if
               end associate
            end associate
         end do
      end do

   contains

      !> Is a point of another part, too?
      pure logical function is_shared(point)
         integer, intent(in) :: point
         integer :: s

         is_shared = .false.
         do s = 1, near%n
            if (part(s) == 0 .or. part(s) == part(t)) cycle
            is_shared = is_shared .or. any(sides%triangles%split%corner(:, near%triangle(s)) &
               == point)
         end do
      end function is_shared

   end subroutine find_fading

   !> Is a triangle listed, or would it be if it were nearer?
   pure logical function patch_near_goes_on(near, sides, other, x, u) result(goes_on)
      type(patch_near_t), intent(in) :: near
      type(patch_sides_t), intent(in) :: sides
      integer, intent(in) :: other               !! of the master; 0: none
      real(wp), intent(in), contiguous :: x(:, :), u(:, :)   !! (3, n_node) [L]

      goes_on = .false.
      if (other == 0) return
      associate (k => find_sorted(near%triangle, other))
         if (k > 0) then
            if (near%is_apart(k)) return
         end if
      end associate
      goes_on = faces(near, sides, other, x, u)
   end function patch_near_goes_on

   !> Does a triangle face the frame?
   pure logical function faces(near, sides, triangle, x, u)
      type(patch_near_t), intent(in) :: near
      type(patch_sides_t), intent(in) :: sides
      integer, intent(in) :: triangle            !! of the master
      real(wp), intent(in), contiguous :: x(:, :), u(:, :)   !! (3, n_node) [L]
      real(wp) :: corner(3, 3), own(3)
      integer :: k

      faces = .not. is_mirror(sides, near%point, triangle)
      if (.not. faces) return
      do k = 1, 3
         corner(:, k) = sides_place(sides, sides%triangles%split%corner(k, triangle), &
            sides%frames%base(near%point), x, u)
      end do
      own = cross_product(corner(:, 2) - corner(:, 1), corner(:, 3) - corner(:, 1))
      faces = dot_product(own, near%along) < facing*sqrt(dot_product(own, own))
   end function faces

   !> Is a triangle in a plane of symmetry along whose axis a contact point rests? Neither comes
   !> nearer to the other.
   pure logical function is_mirror(sides, i, triangle)
      type(patch_sides_t), intent(in) :: sides
      integer, intent(in) :: i, triangle

      associate (axis => sides%mirror(sides%triangles%split%facet(triangle)))
         is_mirror = axis > 0
         if (is_mirror) is_mirror = sides%rests(axis, i)
      end associate
   end function is_mirror

end module emcon_patch_near_space
