!> *SURFACE, TYPE=PLANE, SPHERE, REVOLUTION and CYLINDER: shapes in space, with nodes of their own
!> that a *RIGID BODY takes.
module emcon_deck_walls_space
   use emcon_deck_fields, only : check_count, data_error, data_open, data_t, get_name, get_real, &
      next_line
   use emcon_deck_own_nodes, only : add_own_nodes
   use emcon_deck_reader, only : card_error, card_t, reader_t
   use emcon_deck_segment_lines_plane, only : read_segment_lines
   use emcon_deck_wall_profile_plane, only : profile_finish
   use emcon_diagnostics, only : quoted
   use emcon_kinds, only : wp
   use emcon_mesh, only : surface_of_extrusion, surface_of_plane, surface_of_revolution, &
      surface_of_sphere, surface_t
   use emcon_profile_fillet_plane, only : segment_t
   use emcon_rotation, only : cross_product
   use emcon_scene, only : scene_t
   use emcon_wall, only : wall_drawn, wall_flat, wall_round, wall_t, wall_turned
   implicit none
   private
   public :: read_wall

   !> Directions at right angles are so to this.
   real(wp), parameter :: rounding = 1.0e-6_wp
   integer, parameter :: n_dim = 3

contains

   !> The shape of a card, and its nodes behind those of `scene`.
   subroutine read_wall(reader, card, kind, scene, surface)
      type(reader_t), intent(inout) :: reader
      type(card_t), intent(in) :: card
      integer, intent(in) :: kind                  !! one of `surface_of_`
      type(scene_t), intent(inout) :: scene
      type(surface_t), intent(inout) :: surface
      real(wp) :: origin(n_dim), vector(n_dim, n_dim)
      type(data_t) :: data
      integer :: n_before, k

      n_before = reader%log%n_errors
      surface%is_profile = .true.
      allocate(surface%wall)
      associate (wall => surface%wall)
         call data_open(data, card)
         select case (kind)
         case (surface_of_plane)
            call read_plane(reader, card, data, scene, wall, origin, vector)
         case (surface_of_sphere)
            call read_sphere(reader, card, data, wall, origin, vector)
         case (surface_of_revolution)
            wall%kind = wall_turned
            call read_revolution(reader, card, data, origin, vector)
         case (surface_of_extrusion)
            wall%kind = wall_drawn
            call read_extrusion(reader, card, data, origin, vector)
         end select
         if (data%ok .and. any(wall%kind == [wall_turned, wall_drawn])) call read_profile(reader, &
            card, data, wall)
         if (reader%log%n_errors == n_before .and. wall%extent > 0.0_wp) then
            if (.not. wall%arm > 0.0_wp) wall%arm = wall%extent
            call add_own_nodes(scene, card%origin, spread(origin, 2, 1 + n_dim) + wall%arm &
               *reshape([(0.0_wp, k = 1, n_dim), vector], [n_dim, 1 + n_dim]), surface%node)
            wall%node = surface%node
         else
            deallocate(surface%wall)
            reader%doubt%names = .true.
         end if
      end associate
   end subroutine read_wall

   !> The numbers of the next data line, as many as `x` has; others may follow.
   subroutine get_numbers(reader, card, data, most, what, x)
      type(reader_t), intent(inout) :: reader
      type(card_t), intent(in) :: card
      type(data_t), intent(inout) :: data
      integer, intent(in) :: most                  !! fields of the line
      character(len=*), intent(in) :: what
      real(wp), intent(out) :: x(:)
      integer :: k

      x = 0.0_wp
      data%ok = next_line(reader, data)
      if (.not. data%ok) then
         call card_error(reader, card, "a data line is missing: " // what)
         return
      end if
      data%ok = .true.
      call check_count(reader, data, size(x), most, what)
      do k = 1, size(x)
         if (data%ok) call get_real(reader, data, k, "coordinate", x(k))
      end do
   end subroutine get_numbers

   !> Nothing follows.
   subroutine check_end(reader, data)
      type(reader_t), intent(inout) :: reader
      type(data_t), intent(inout) :: data

      do while (next_line(reader, data))
         call data_error(reader, data, "a line too much")
      end do
   end subroutine check_end

   subroutine read_plane(reader, card, data, scene, wall, origin, vector)
      type(reader_t), intent(inout) :: reader
      type(card_t), intent(in) :: card
      type(data_t), intent(inout) :: data
      type(scene_t), intent(in) :: scene
      type(wall_t), intent(inout) :: wall
      real(wp), intent(out) :: origin(:), vector(:, :)
      real(wp) :: x(2*n_dim)

      wall%kind = wall_flat
      call get_numbers(reader, card, data, size(x), "x, y, z of a point of the plane, then of " &
         // "its normal, out of the body", x)
      if (.not. data%ok) return
      origin = x(:n_dim)
      if (.not. norm2(x(n_dim + 1:)) > 0.0_wp) call data_error(reader, data, &
         "the normal has no length")
      if (.not. data%ok) return
      call complete(x(n_dim + 1:), vector)
      ! As large as what it meets.
      if (size(scene%x) > 0) wall%extent = norm2(maxval(scene%x, 2) - minval(scene%x, 2))
      if (.not. wall%extent > 0.0_wp) wall%extent = norm2(x(n_dim + 1:))
      call check_end(reader, data)
   end subroutine read_plane

   subroutine read_sphere(reader, card, data, wall, origin, vector)
      type(reader_t), intent(inout) :: reader
      type(card_t), intent(in) :: card
      type(data_t), intent(inout) :: data
      type(wall_t), intent(inout) :: wall
      real(wp), intent(out) :: origin(:), vector(:, :)
      character(len=:), allocatable :: side
      real(wp) :: x(n_dim + 1)
      integer :: k

      wall%kind = wall_round
      call get_numbers(reader, card, data, size(x) + 1, "x, y, z of the centre, radius, and " // &
         "INSIDE where bodies are inside", x)
      if (.not. data%ok) return
      origin = x(:n_dim)
      vector = reshape([(merge(1.0_wp, 0.0_wp, mod(k, n_dim + 1) == 0), k = 0, n_dim**2 - 1)], &
         [n_dim, n_dim])
      wall%radius = x(n_dim + 1)
      wall%extent = wall%radius
      if (.not. wall%radius > 0.0_wp) call data_error(reader, data, "the radius is not above 0")
      if (data%n > size(x)) then
         call get_name(reader, data, size(x) + 1, "side", side)
         if (data%ok .and. all(side /= ["INSIDE ", "OUTSIDE"])) call data_error(reader, data, &
            "expected INSIDE or OUTSIDE, not " // quoted(side))
         if (side == "INSIDE") wall%bulge = -1.0_wp
      end if
      call check_end(reader, data)
   end subroutine read_sphere

   !> The axis from point a to point b.
   subroutine read_revolution(reader, card, data, origin, vector)
      type(reader_t), intent(inout) :: reader
      type(card_t), intent(in) :: card
      type(data_t), intent(inout) :: data
      real(wp), intent(out) :: origin(:), vector(:, :)
      real(wp) :: x(2*n_dim)

      call get_numbers(reader, card, data, size(x), "x, y, z of point a, then of point b of the " &
         // "axis", x)
      if (.not. data%ok) return
      origin = x(:n_dim)
      if (.not. norm2(x(n_dim + 1:) - origin) > 0.0_wp) call data_error(reader, data, &
         "points a and b are the same")
      if (data%ok) call complete(x(n_dim + 1:) - origin, vector)
   end subroutine read_revolution

   !> The first axis from point a to point b; from a to point c the direction in which the profile
   !> is drawn, against the third axis.
   subroutine read_extrusion(reader, card, data, origin, vector)
      type(reader_t), intent(inout) :: reader
      type(card_t), intent(in) :: card
      type(data_t), intent(inout) :: data
      real(wp), intent(out) :: origin(:), vector(:, :)
      real(wp) :: x(2*n_dim), c(n_dim), along(n_dim)

      call get_numbers(reader, card, data, size(x), "x, y, z of point a, then of point b on the " &
         // "first axis of the profile", x)
      if (.not. data%ok) return
      origin = x(:n_dim)
      vector(:, 1) = x(n_dim + 1:) - origin
      if (.not. norm2(vector(:, 1)) > 0.0_wp) then
         call data_error(reader, data, "points a and b are the same")
         return
      end if
      call get_numbers(reader, card, data, n_dim, "x, y, z of point c, to which the profile is " &
         // "drawn from a", c)
      if (.not. data%ok) return
      along = c - origin
      if (.not. norm2(along) > 0.0_wp) then
         call data_error(reader, data, "points a and c are the same")
      else if (abs(dot_product(along, vector(:, 1))) > rounding*norm2(along)*norm2(vector(:, 1))) &
         then
         call data_error(reader, data, "the way from a to c is not at a right angle to that from " &
            // "a to b")
      end if
      if (.not. data%ok) return
      vector(:, 1) = vector(:, 1)/norm2(vector(:, 1))
      vector(:, 2) = cross_product(vector(:, 1), along)
      vector(:, 2) = vector(:, 2)/norm2(vector(:, 2))
      vector(:, 3) = cross_product(vector(:, 1), vector(:, 2))
   end subroutine read_extrusion

   subroutine read_profile(reader, card, data, wall)
      type(reader_t), intent(inout) :: reader
      type(card_t), intent(in) :: card
      type(data_t), intent(inout) :: data
      type(wall_t), intent(inout) :: wall
      type(segment_t), allocatable :: segment(:)
      logical :: is_well

      call read_segment_lines(reader, card, data, segment, is_well)
      if (is_well) call profile_finish(segment, reader, card, wall)
   end subroutine read_profile

   !> Three directions of length 1 at right angles, the first one along `way`.
   pure subroutine complete(way, vector)
      real(wp), intent(in) :: way(:)
      real(wp), intent(out) :: vector(:, :)

      vector = 0.0_wp
      vector(:, 1) = way/norm2(way)
      vector(minloc(abs(way), 1), 2) = 1.0_wp
      vector(:, 3) = cross_product(vector(:, 1), vector(:, 2))
      vector(:, 3) = vector(:, 3)/norm2(vector(:, 3))
      vector(:, 2) = cross_product(vector(:, 3), vector(:, 1))
   end subroutine complete

end module emcon_deck_walls_space
