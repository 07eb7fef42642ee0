!> The surfaces of contact pairs and ties in space: outer faces that make up surfaces, none of them
!> flat.
module emcon_deck_contact_space
   use emcon_deck_check_surfaces, only : check_free
   use emcon_deck_adjacency, only : adjacency_init, adjacency_t
   use emcon_deck_reader, only : reader_t
   use emcon_diagnostics, only : add_error
   use emcon_face_sides_space, only : face_fault, face_sides, last_of_side, side_t
   use emcon_interactions, only : formulation_user
   use emcon_mesh, only : surface_t
   use emcon_scene, only : scene_t
   use emcon_surface_facets, only : surface_facets
   use emcon_text, only : joined, string_t, to_text
   implicit none
   private
   public :: check_contact_space

   !> Faces named in a message.
   integer, parameter :: most_named = 10

contains

   !> Every surface that is in contact, but for that of a program, or tied.
   subroutine check_contact_space(reader, scene)
      type(reader_t), intent(inout) :: reader
      type(scene_t), intent(in) :: scene
      type(adjacency_t) :: adjacency
      character(len=:), allocatable :: title
      integer, allocatable :: facet(:, :)
      logical :: is_tied, in_contact
      integer :: i, n_errors

      if (reader%doubt%shapes) return
      if (all(scene%pair%formulation == formulation_user) .and. size(scene%tie) == 0) return
      call adjacency_init(adjacency, scene)
      do i = 1, size(scene%surface)
         in_contact = any((scene%pair%slave == i .or. scene%pair%master == i) .and. &
            scene%pair%formulation /= formulation_user)
         is_tied = any(scene%tie%slave == i .or. scene%tie%master == i)
         if (.not. (in_contact .or. is_tied)) cycle
         associate (surface => scene%surface(i))
            title = trim(merge("contact", "tied   ", in_contact)) // " surface " // surface%name
            if (size(surface%element) == 0) cycle      ! a shape: its reader has looked at it
            n_errors = reader%log%n_errors
            call check_free(reader, scene, adjacency, surface, title)
            if (reader%log%n_errors > n_errors) cycle
            call surface_facets(scene, surface, facet)
            if (size(facet, 2) == 0) cycle
            if (any(facet(1, :) == 0)) cycle
            call check_sides(reader, scene, surface, facet, title)
            if (.not. reader%doubt%positions) call check_shapes(reader, scene, surface, facet, &
               title)
         end associate
      end do
   end subroutine check_contact_space

   !> Two faces at most meet in a side, and they run it in unlike ways.
   subroutine check_sides(reader, scene, surface, facet, title)
      type(reader_t), intent(inout) :: reader
      type(scene_t), intent(in) :: scene
      type(surface_t), intent(in) :: surface
      integer, intent(in) :: facet(:, :)
      character(len=*), intent(in) :: title
      type(side_t), allocatable :: side(:)
      integer :: first, last, n_branch, n_back, branch, back

      call face_sides(facet, side)
      n_branch = 0
      n_back = 0
      branch = 0
      back = 0
      first = 1
      do while (first <= size(side))
         last = last_of_side(side, first)
         if (last > first + 1) then
            n_branch = n_branch + 1
            if (branch == 0) branch = first
         else if (last == first + 1) then
            if (side(first)%is_up .eqv. side(last)%is_up) then
               n_back = n_back + 1
               if (back == 0) back = first
            end if
         end if
         first = last + 1
      end do
      if (n_branch > 0) call tell(" branches: more than two of its faces meet in ", branch, &
         n_branch)
      if (n_back > 0) call tell(" has no common outside: two of its faces meet back to back in ", &
         back, n_back)

   contains

      !> What is wrong in side `i` and others, `n` in all.
      subroutine tell(what, i, n)
         character(len=*), intent(in) :: what
         integer, intent(in) :: i, n
         character(len=:), allocatable :: more, place

         more = ""
         if (n > 1) more = " and in " // to_text(n - 1) // " more"
         call place_text(scene, surface, side, i, place)
         call add_error(reader%log, surface%origin, title // what // place // more // &
            "; put them into surfaces of their own")
      end subroutine tell

   end subroutine check_sides

   !> Where side `i` is, and what meets in it.
   subroutine place_text(scene, surface, side, i, text)
      type(scene_t), intent(in) :: scene
      type(surface_t), intent(in) :: surface
      type(side_t), intent(in) :: side(:)
      integer, intent(in) :: i                   !! the first one of its nodes
      character(len=:), allocatable, intent(out) :: text
      type(string_t), allocatable :: face(:)
      integer :: k

      associate (here => side(i))
         allocate(face(count(side%low == here%low .and. side%high == here%high)))
         do k = 1, size(face)
            call face_text(scene, surface, side(i + k - 1)%facet, face(k)%text)
         end do
         text = "the side of nodes " // to_text(scene%node%label(here%low)) // " and " // &
            to_text(scene%node%label(here%high)) // " (" // joined(face, ", ", most_named) // ")"
      end associate
   end subroutine place_text

   !> "S2 of element 7" for facet `f`.
   subroutine face_text(scene, surface, f, text)
      type(scene_t), intent(in) :: scene
      type(surface_t), intent(in) :: surface
      integer, intent(in) :: f                   !! in space one for each face
      character(len=:), allocatable, intent(out) :: text

      text = "S" // to_text(surface%face(f)) // " of element " // &
         to_text(scene%element%label(surface%element(f)))
   end subroutine face_text

   !> Faces have an area, and about their middle they are not folded.
   subroutine check_shapes(reader, scene, surface, facet, title)
      type(reader_t), intent(inout) :: reader
      type(scene_t), intent(in) :: scene
      type(surface_t), intent(in) :: surface
      integer, intent(in) :: facet(:, :)
      character(len=*), intent(in) :: title
      logical, dimension(size(facet, 2)) :: is_flat, is_folded
      integer :: f

      do f = 1, size(is_flat)
         associate (m => count(facet(:, f) > 0))
            call face_fault(scene%x(:, facet(:m, f)), is_flat(f), is_folded(f))
         end associate
      end do
      call tell(is_flat, " has a face without area: ")
      call tell(is_folded, " has a face that is folded over, seen from its middle: ")

   contains

      subroutine tell(is_wrong, what)
         logical, intent(in) :: is_wrong(:)
         character(len=*), intent(in) :: what
         type(string_t) :: face(count(is_wrong))
         integer :: k, n

         if (.not. any(is_wrong)) return
         n = 0
         do k = 1, size(is_wrong)
            if (.not. is_wrong(k)) cycle
            n = n + 1
            call face_text(scene, surface, k, face(n)%text)
         end do
         call add_error(reader%log, surface%origin, title // what // joined(face, ", ", most_named))
      end subroutine tell

   end subroutine check_shapes

end module emcon_deck_contact_space
