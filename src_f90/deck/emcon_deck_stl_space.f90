!> *SURFACE, TYPE=STL: a rigid surface of triangles in space, with nodes of its own that a *RIGID
!> BODY takes.
module emcon_deck_stl_space
   use emcon_deck_fields, only : check_count, data_open, data_t, get_real, next_line
   use emcon_deck_own_nodes, only : add_own_nodes
   use emcon_deck_reader, only : card_error, card_t, card_warning, option_real, reader_t
   use emcon_kinds, only : wp
   use emcon_mesh, only : surface_t
   use emcon_scene, only : scene_t
   use emcon_text, only : to_text
   use emcon_triangle_soup_space, only : finding_t, soup_join, soup_t
   implicit none
   private
   public :: read_stl

   integer, parameter :: n_dim = 3, n_corner = 3

contains

   !> The triangles of a card, and their nodes behind those of `scene`.
   subroutine read_stl(reader, card, scene, surface)
      type(reader_t), intent(inout) :: reader
      type(card_t), intent(in) :: card
      type(scene_t), intent(inout) :: scene
      type(surface_t), intent(inout) :: surface
      type(soup_t) :: soup
      real(wp), allocatable :: corner(:, :, :)
      integer, allocatable :: node(:)
      integer :: n_before, f

      surface%is_profile = .true.
      n_before = reader%log%n_errors
      call read_corners(reader, card, corner)
      if (reader%log%n_errors == n_before .and. size(corner, 3) > 0) then
         call soup_join(soup, corner)
         call tell(reader, card, soup)
      else if (reader%log%n_errors == n_before .and. .not. reader%doubt%names) then
         call card_error(reader, card, "INPUT=file is missing, or lines of nine coordinates, " &
            // "those of the corners of a triangle")
      end if
      if (reader%log%n_errors > n_before .or. .not. allocated(soup%point)) then
         reader%doubt%names = .true.
         return
      end if
      call add_own_nodes(scene, card%origin, soup%point, node)
      allocate(surface%edge(n_corner, size(soup%facet, 2)))
      do f = 1, size(soup%facet, 2)
         surface%edge(:, f) = node(soup%facet(:, f))
      end do
   end subroutine read_stl

   !> The corners of all data lines, times SCALE.
   subroutine read_corners(reader, card, corner)
      type(reader_t), intent(inout) :: reader
      type(card_t), intent(in) :: card
      real(wp), allocatable, intent(out) :: corner(:, :, :)  !! (3, corner, n) [L]
      type(data_t) :: data
      real(wp) :: x(n_dim*n_corner), factor
      integer :: n, k

      factor = 1.0_wp
      call option_real(reader, card, "SCALE", factor)
      allocate(corner(n_dim, n_corner, max(0, card%last - card%first + 1)))
      n = 0
      call data_open(data, card)
      do while (next_line(reader, data))
         call check_count(reader, data, size(x), size(x), "x, y, z of the three corners of a " &
            // "triangle")
         do k = 1, size(x)
            if (data%ok) call get_real(reader, data, k, "coordinate", x(k))
         end do
         if (.not. data%ok) cycle
         n = n + 1
         corner(:, :, n) = factor*reshape(x, [n_dim, n_corner])
      end do
      corner = corner(:, :, :n)
   end subroutine read_corners

   !> What is odd about a surface, and what makes it none.
   subroutine tell(reader, card, soup)
      type(reader_t), intent(inout) :: reader
      type(card_t), intent(in) :: card
      type(soup_t), intent(in) :: soup

      if (size(soup%facet, 2) == 0) then
         call card_error(reader, card, "no facet has an area")
      else if (soup%branch%n > 0) then
         call card_error(reader, card, "the surface branches: more than two facets meet in " // &
            trim(many(soup%branch, "side")))
      else if (soup%twisted%n > 0) then
         call card_error(reader, card, "the surface has no outside: going around, facet " // &
            to_text(soup%twisted%first) // " faces both ways")
      end if
      if (soup%flat%n > 0) call card_warning(reader, card, trim(many(soup%flat, "facet")) // &
         " without area left out")
      if (soup%turned%n > 0) call card_warning(reader, card, trim(many(soup%turned, "facet")) // &
         " turned over, as most around face the other way")
      if (soup%is_inward) call card_warning(reader, card, "the facets of the closed surface " // &
         "face inwards: it is a hole, and bodies are to be inside of it")
      if (soup%open%n > 0) call card_warning(reader, card, "the surface is not closed: " // &
         trim(many(soup%open, "side")) // " of one facet alone; bodies are to be on the side " &
         // "that its facets face")
   end subroutine tell

   !> "3 facets (the first: facet 7)".
   pure function many(finding, what) result(text)
      type(finding_t), intent(in) :: finding
      character(len=*), intent(in) :: what
      character(len=80) :: text

      text = to_text(finding%n) // " " // what
      if (finding%n > 1) text = trim(text) // "s"
      text = trim(text) // " (the first: facet " // to_text(finding%first) // ")"
   end function many

end module emcon_deck_stl_space
