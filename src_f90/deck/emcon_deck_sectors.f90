!> *CYCLIC SYMMETRY MODEL: the sectors that ties with CYCLIC SYMMETRY close to a ring.
module emcon_deck_sectors
   use emcon_deck_dimension, only : n_space
   use emcon_deck_fields, only : check_count, data_error, data_open, data_t, get_real, next_line
   use emcon_deck_reader, only : card_error, card_t, has_option, option_count, option_name, &
      reader_t
   use emcon_diagnostics, only : quoted
   use emcon_kinds, only : wp
   use emcon_scene, only : scene_t
   use emcon_surface_nodes, only : surface_nodes
   use emcon_text, only : to_text
   use emcon_tie_maps, only : tie_map_is_given, tie_map_place, tie_map_t, tie_map_turn
   implicit none
   private
   public :: read_sectors, is_cyclic

   real(wp), parameter :: full_turn = 8.0_wp*atan(1.0_wp)
   !> Two points of the axis, and their numbers on a data line.
   integer, parameter :: n_point = 2, n_axis = n_point*n_space
   !> Ways to turn.
   integer, parameter :: n_way = 2
   integer, parameter :: least_sectors = 2

contains

   !> All cards: how the masters of their ties stand for the slaves.
   subroutine read_sectors(reader, scene)
      type(reader_t), intent(inout) :: reader
      type(scene_t), intent(inout) :: scene
      integer :: i, k

      do i = 1, size(reader%card)
         if (reader%card(i)%name == "CYCLICSYMMETRYMODEL") call read_card(reader, &
            reader%card(i), scene)
      end do
      if (reader%log%n_errors > 0) return
      do i = 1, size(reader%card)
         if (.not. is_cyclic(reader%card(i))) cycle
         do k = 1, size(scene%tie)
            if (scene%tie(k)%name /= option_name(reader%card(i), "NAME")) cycle
            if (tie_map_is_given(scene%tie(k)%map)) cycle
            call card_error(reader, reader%card(i), "CYCLIC SYMMETRY needs *CYCLIC SYMMETRY " // &
               "MODEL, N=, TIE=" // scene%tie(k)%name // " with two points of the axis")
            exit
         end do
      end do
   end subroutine read_sectors

   !> Is a card a *TIE with CYCLIC SYMMETRY?
   pure logical function is_cyclic(card)
      type(card_t), intent(in) :: card

      is_cyclic = card%name == "TIE" .and. has_option(card, "CYCLICSYMMETRY")
      if (is_cyclic) is_cyclic = option_name(card, "CYCLICSYMMETRY") /= "NO"
   end function is_cyclic

   !> One card.
   subroutine read_card(reader, card, scene)
      type(reader_t), intent(inout) :: reader
      type(card_t), intent(in) :: card
      type(scene_t), intent(inout) :: scene
      character(len=:), allocatable :: name
      real(wp) :: point(n_space, n_point)
      integer :: n_sector, k

      n_sector = 0
      call option_count(reader, card, "N", least_sectors, n_sector)
      if (.not. has_option(card, "N")) call card_error(reader, card, "parameter N= is missing: " &
         // "how many sectors make a full turn")
      call find_tie(reader, card, name)
      call read_axis(reader, card, scene%n_dim, point)
      if (n_sector == 0 .or. name == "" .or. reader%log%n_errors > 0) return
      do k = 1, size(scene%tie)
         if (scene%tie(k)%name /= name .or. scene%tie(k)%master == 0) cycle
         if (tie_map_is_given(scene%tie(k)%map)) then
            call card_error(reader, card, "tie " // name // " has one already")
            return
         end if
         call turn_tie(scene, k, point, full_turn/n_sector)
      end do
   end subroutine read_card

   !> The tie that a card is for: the only one with CYCLIC SYMMETRY, if it does not say.
   subroutine find_tie(reader, card, name)
      type(reader_t), intent(inout) :: reader
      type(card_t), intent(in) :: card
      character(len=:), allocatable, intent(out) :: name     !! "": none
      character(len=:), allocatable :: wanted
      integer :: i, n

      name = ""
      wanted = option_name(card, "TIE")
      n = 0
      do i = 1, size(reader%card)
         if (.not. is_cyclic(reader%card(i))) cycle
         if (wanted /= "" .and. option_name(reader%card(i), "NAME") /= wanted) cycle
         n = n + 1
         name = option_name(reader%card(i), "NAME")
      end do
      if (n == 1) return
      name = ""
      if (wanted /= "") then
         call card_error(reader, card, "there is no *TIE, CYCLIC SYMMETRY of the name " // &
            quoted(wanted))
      else
         call card_error(reader, card, "there are " // to_text(n) // " *TIE with CYCLIC " // &
            "SYMMETRY; " // trim(merge("TIE= is to say which", "the card needs one  ", n > 1)))
      end if
   end subroutine find_tie

   !> Two points of the axis; in the plane one point, with or without a third coordinate and the
   !> same point above it.
   subroutine read_axis(reader, card, n_dim, point)
      type(reader_t), intent(inout) :: reader
      type(card_t), intent(in) :: card
      integer, intent(in) :: n_dim
      real(wp), intent(out) :: point(n_space, n_point)     !! [L]
      type(data_t) :: data
      real(wp) :: value(n_axis)
      integer :: k

      value = 0.0_wp
      call data_open(data, card)
      if (.not. next_line(reader, data)) then
         call card_error(reader, card, "the axis is not given; expected two points of it: " // &
            "x, y, z, x, y, z")
         return
      end if
      call check_count(reader, data, merge(n_axis, n_dim, n_dim == n_space), n_axis, &
         "two points of the axis: x, y, z, x, y, z")
      if (.not. data%ok) return
      do k = 1, data%n
         call get_real(reader, data, k, "coordinate of the axis", value(k))
      end do
      if (n_dim < n_space .and. data%n <= n_space) value(n_space + 1:) = value(:n_space) &
         + [0.0_wp, 0.0_wp, 1.0_wp]
      point = reshape(value, [n_space, n_point])
      if (.not. norm2(point(:, 2) - point(:, 1)) > 0.0_wp) then
         call data_error(reader, data, "the two points of the axis are one")
      else if (n_dim < n_space .and. any(abs(point(:n_dim, 2) - point(:n_dim, 1)) > 0.0_wp)) then
         call data_error(reader, data, "the axis is to be across the plane: the same x, y twice")
      end if
   end subroutine read_axis

   !> The master of tie `k` turned by the angle of a sector, to the side on which the slave is.
   subroutine turn_tie(scene, k, point, angle)
      type(scene_t), intent(inout) :: scene
      integer, intent(in) :: k
      real(wp), intent(in) :: point(n_space, n_point)      !! of the axis [L]
      real(wp), intent(in) :: angle                  !! [rad]
      type(tie_map_t) :: map(n_way)
      real(wp) :: slave(scene%n_dim), master(scene%n_dim), axis(n_space), off(n_way)
      integer :: way

      axis = (point(:, n_point) - point(:, 1))/norm2(point(:, n_point) - point(:, 1))
      slave = middle(scene%tie(k)%slave)
      master = middle(scene%tie(k)%master)
      do way = 1, n_way
         call tie_map_turn(map(way), point(:scene%n_dim, 1), axis, merge(angle, -angle, way == 1))
         off(way) = norm2(tie_map_place(map(way), master) - slave)
      end do
      scene%tie(k)%map = map(merge(1, 2, off(1) < off(2)))

   contains

      pure function middle(surface)
         integer, intent(in) :: surface
         real(wp) :: middle(scene%n_dim)
         integer, allocatable :: node(:)

         call surface_nodes(scene, scene%surface(surface), node)
         middle = sum(scene%x(:, node), 2)/max(1, size(node))
      end function middle

   end subroutine turn_tie

end module emcon_deck_sectors
